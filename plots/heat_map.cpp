#include "plots/heat_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "plots/line_plot.h"

namespace touchstone::plots {
namespace {

constexpr double kWidth = 640.0, kHeight = 440.0;
constexpr double kLeft = 78.0, kRight = 626.0, kTop = 34.0, kBottom = 386.0;

/// Even in lightness and distinguishable for the colour-blind: anchors of Matplotlib's "viridis" [Walt2015], which is
/// CC0.
std::array<int, 3> colour_at(double share) {
  static constexpr std::array<std::array<double, 3>, 6> kAnchors = {
      {{68, 1, 84}, {65, 68, 135}, {42, 120, 142}, {34, 168, 132}, {122, 209, 81}, {253, 231, 37}}};
  const double at = std::clamp(share, 0.0, 1.0) * (kAnchors.size() - 1);
  const auto k = std::min(static_cast<std::size_t>(at), kAnchors.size() - 2);
  std::array<int, 3> colour{};
  for (std::size_t c = 0; c < 3; ++c) {
    colour[c] = static_cast<int>(
        std::lround(kAnchors[k][c] + (at - static_cast<double>(k)) * (kAnchors[k + 1][c] - kAnchors[k][c])));
  }
  return colour;
}

}  // namespace

std::string to_svg(const HeatMap& map) {
  TS_ASSERT(map.values.size() == map.x.size() && !map.x.empty() && !map.y.empty());
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const auto& column : map.values) {
    TS_ASSERT(column.size() == map.y.size());
    for (const double value : column) {
      if (!std::isfinite(value)) continue;
      low = std::min(low, value);
      high = std::max(high, value);
    }
  }
  const bool logarithmic = map.logarithmic && low > 0.0;
  const auto scaled = [&](double value) { return logarithmic ? std::log(value) : value; };
  const double span = scaled(high) - scaled(low);
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0:.0f} {1:.0f}\" width=\"{0:.0f}\" height=\"{1:.0f}\" "
      "role=\"img\" font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"{0:.0f}\" height=\"{1:.0f}\" "
      "fill=\"#fff\"/>\n<text x=\"{2:.1f}\" y=\"21.0\" font-weight=\"bold\">{3}</text>\n",
      kWidth, kHeight, kLeft, escape_markup(map.title));
  const double wide = (kRight - kLeft) / static_cast<double>(map.x.size());
  const double tall = (kBottom - kTop) / static_cast<double>(map.y.size());
  const double letters = std::clamp(wide / 4.2, 6.0, 12.0);
  std::string frames;
  for (std::size_t i = 0; i < map.x.size(); ++i) {
    const double left = kLeft + wide * static_cast<double>(i);
    for (std::size_t j = 0; j < map.y.size(); ++j) {
      const double top = kBottom - tall * static_cast<double>(j + 1);
      const double value = map.values[i][j];
      const bool had = std::isfinite(value);
      const auto [r, g, b] =
          had ? colour_at(span > 0.0 ? (scaled(value) - scaled(low)) / span : 0.5) : std::array<int, 3>{238, 238, 238};
      svg += fmt::format(
          "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"#{:02x}{:02x}{:02x}\"/>\n", left,
          top, wide, tall, r, g, b);
      const bool light = 0.299 * r + 0.587 * g + 0.114 * b > 140.0;
      svg += fmt::format(
          "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\" font-size=\"{:.1f}\" fill=\"{}\">{}</text>\n",
          left + 0.5 * wide, top + 0.5 * tall + 0.35 * letters, letters, light ? "#000" : "#fff",
          had ? fmt::format("{:.3g}", value) : "-");
      if (!map.marked.empty() && map.marked[i][j]) {
        frames += fmt::format(
            "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"none\" stroke=\"#d55e00\" "
            "stroke-width=\"3\"/>\n",
            left + 1.5, top + 1.5, wide - 3.0, tall - 3.0);
      }
    }
    svg += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{:.4g}</text>\n", left + 0.5 * wide,
                       kBottom + 17.0, map.x[i]);
  }
  for (std::size_t j = 0; j < map.y.size(); ++j) {
    svg += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"end\">{:.4g}</text>\n", kLeft - 6.0,
                       kBottom - tall * (static_cast<double>(j) + 0.5) + 4.0, map.y[j]);
  }
  svg += frames;
  svg += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>\n", 0.5 * (kLeft + kRight),
                     kHeight - 14.0, escape_markup(map.x_label));
  svg += fmt::format("<text transform=\"translate(16 {:.1f}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
                     0.5 * (kTop + kBottom), escape_markup(map.y_label));
  return svg + "</svg>\n";
}

}  // namespace touchstone::plots
