#include "plots/histogram_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "plots/line_plot.h"

namespace touchstone::plots {
namespace {

constexpr double kPaperWidth = 320.0;
constexpr double kPaperHeight = 220.0;
constexpr double kBarsLeft = 44.0;
constexpr double kBarsRight = 308.0;
constexpr double kBarsTop = 30.0;
constexpr double kBarsBottom = 158.0;

std::string label(double x, double y, const char* anchor, const std::string& text, const char* more = "") {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\"{}>{}</text>\n", x, y, anchor, more,
                     escape_markup(text));
}

}  // namespace

std::string to_svg(const HistogramPlot& plot) {
  std::vector<double> values;
  double sum = 0.0;
  for (const double value : plot.values) {
    if (!std::isfinite(value)) continue;
    values.push_back(value);
    sum += value;
  }
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0:.0f} {1:.0f}\" width=\"{0:.0f}\" height=\"{1:.0f}\" "
      "role=\"img\" font-family=\"sans-serif\" font-size=\"11\">\n<rect width=\"{0:.0f}\" height=\"{1:.0f}\" "
      "fill=\"#fff\"/>\n",
      kPaperWidth, kPaperHeight);
  svg += label(kBarsLeft, 18.0, "start", plot.title, " font-weight=\"bold\"");
  const std::size_t left_out = plot.values.size() - values.size();
  if (values.empty()) {
    svg += label(0.5 * kPaperWidth, 0.5 * kPaperHeight, "middle", "no values");
    return svg + "</svg>\n";
  }
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  double low = *least;
  double high = *most;
  // Rounding isn't spread.
  if (high - low <= 1e-9 * std::max(std::abs(low), std::abs(high))) {
    const double margin = std::max(1e-6, 0.05 * std::abs(low));
    low -= margin;
    high += margin;
  }
  const int bins = std::clamp(static_cast<int>(values.size() / 4), 5, std::max(5, plot.bins));
  std::vector<int> counts(static_cast<std::size_t>(bins), 0);
  for (const double value : values) {
    const int bin = std::min(bins - 1, static_cast<int>((value - low) / (high - low) * bins));
    ++counts[static_cast<std::size_t>(std::max(0, bin))];
  }
  const int tallest = *std::max_element(counts.begin(), counts.end());
  const double width = (kBarsRight - kBarsLeft) / bins;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (counts[i] == 0) continue;
    const double height = (kBarsBottom - kBarsTop) * counts[i] / tallest;
    svg += fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"#0072b2\"/>\n",
                       kBarsLeft + static_cast<double>(i) * width + 0.5, kBarsBottom - height, width - 1.0, height);
  }
  svg += fmt::format("<line x1=\"{0:.1f}\" y1=\"{2:.1f}\" x2=\"{1:.1f}\" y2=\"{2:.1f}\" stroke=\"#888\"/>\n", kBarsLeft,
                     kBarsRight, kBarsBottom);
  svg += label(kBarsLeft - 5.0, kBarsTop + 8.0, "end", std::to_string(tallest));
  svg += label(kBarsLeft - 5.0, kBarsBottom + 4.0, "end", "0");
  svg += label(kBarsLeft, kBarsBottom + 16.0, "start", fmt::format("{:.4g}", low));
  svg += label(kBarsRight, kBarsBottom + 16.0, "end", fmt::format("{:.4g}", high));
  svg += label(0.5 * (kBarsLeft + kBarsRight), kBarsBottom + 32.0, "middle", plot.x_label);
  svg += label(0.5 * (kBarsLeft + kBarsRight), kBarsBottom + 50.0, "middle",
               fmt::format("{} samples, {:.4g} to {:.4g}, mean {:.4g}{}", values.size(), *least, *most,
                           sum / static_cast<double>(values.size()),
                           left_out > 0 ? fmt::format("; {} not finite", left_out) : std::string()),
               " fill=\"#666\"");
  return svg + "</svg>\n";
}

}  // namespace touchstone::plots
