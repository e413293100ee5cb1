#include "plots/line_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace touchstone::plots {
namespace {

constexpr double kWidth = 640.0;
constexpr double kHeight = 400.0;
constexpr double kLeft = 78.0;
constexpr double kRight = 620.0;
constexpr double kTop = 34.0;
constexpr double kBottom = 346.0;
// Distinct for the colour-blind [Okabe2008].
constexpr std::array<const char*, 6> kColours = {"#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"};

/// One axis: what it shows and where on the paper.
class Axis {
 public:
  Axis(bool logarithmic, double paper_low, double paper_high)
      : logarithmic_(logarithmic), paper_low_(paper_low), paper_high_(paper_high) {}

  bool shows(double value) const { return std::isfinite(value) && (!logarithmic_ || value > 0.0); }

  void include(double value) {
    low_ = std::min(low_, scaled(value));
    high_ = std::max(high_, scaled(value));
  }

  /// Some margin at both ends; an axis without extent, or without points, gets one.
  void close() {
    if (!(low_ <= high_)) low_ = high_ = 0.0;
    const double margin = high_ > low_ ? 0.06 * (high_ - low_) : std::max(0.5, 0.1 * std::abs(high_));
    low_ -= margin;
    high_ += margin;
  }

  double place(double value) const {
    return paper_low_ + (scaled(value) - low_) / (high_ - low_) * (paper_high_ - paper_low_);
  }

  std::vector<double> ticks() const { return logarithmic_ ? logarithmic_ticks() : even_ticks(); }

 private:
  double scaled(double value) const { return logarithmic_ ? std::log10(value) : value; }

  std::vector<double> logarithmic_ticks() const {
    const double decades = high_ - low_;
    const int step = decades > 8.0 ? static_cast<int>(std::ceil(decades / 8.0)) : 1;
    std::vector<double> factors = {1.0};
    if (decades < 2.2) factors = {1.0, 2.0, 5.0};
    if (decades < 0.6) factors = {1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0};
    std::vector<double> ticks;
    for (int decade = static_cast<int>(std::floor(low_)); decade <= static_cast<int>(std::ceil(high_)); ++decade) {
      if (decade % step != 0) continue;
      for (const double factor : factors) {
        const double at = decade + std::log10(factor);
        if (at >= low_ && at <= high_) ticks.push_back(factor * std::pow(10.0, decade));
      }
    }
    return ticks;
  }

  std::vector<double> even_ticks() const {
    const double rough = (high_ - low_) / 6.0;
    const double decade = std::pow(10.0, std::floor(std::log10(rough)));
    double step = 10.0 * decade;
    for (const double factor : {5.0, 2.0, 1.0}) {
      if (factor * decade >= rough) step = factor * decade;
    }
    std::vector<double> ticks;
    for (double k = std::ceil(low_ / step); k * step <= high_; k += 1.0) ticks.push_back(k * step + 0.0);  // not -0
    return ticks;
  }

  bool logarithmic_;
  double paper_low_, paper_high_;
  double low_ = std::numeric_limits<double>::infinity();
  double high_ = -std::numeric_limits<double>::infinity();
};

std::string text_at(double x, double y, const char* anchor, const std::string& text, const std::string& more = {}) {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\"{}>{}</text>\n", x, y, anchor, more,
                     escape_markup(text));
}

std::string draw_grid(const Axis& x, const Axis& y) {
  std::string svg;
  for (const double tick : x.ticks()) {
    const double at = x.place(tick);
    svg += fmt::format("<line x1=\"{0:.1f}\" y1=\"{1:.1f}\" x2=\"{0:.1f}\" y2=\"{2:.1f}\" stroke=\"#ddd\"/>\n", at,
                       kTop, kBottom);
    svg += text_at(at, kBottom + 17.0, "middle", fmt::format("{:.4g}", tick));
  }
  for (const double tick : y.ticks()) {
    const double at = y.place(tick);
    svg += fmt::format("<line x1=\"{1:.1f}\" y1=\"{0:.1f}\" x2=\"{2:.1f}\" y2=\"{0:.1f}\" stroke=\"#ddd\"/>\n", at,
                       kLeft, kRight);
    svg += text_at(kLeft - 6.0, at + 4.0, "end", fmt::format("{:.4g}", tick));
  }
  svg += fmt::format(
      "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"none\" stroke=\"#888\"/>\n", kLeft,
      kTop, kRight - kLeft, kBottom - kTop);
  return svg;
}

std::string draw_curve(const PlotCurve& curve, const char* colour, const Axis& x, const Axis& y) {
  std::string line;
  std::string marks;
  for (const auto& [px, py] : curve.points) {
    if (!x.shows(px) || !y.shows(py)) continue;
    line += fmt::format("{}{:.1f},{:.1f}", line.empty() ? "" : " ", x.place(px), y.place(py));
    if (curve.dashed) continue;
    marks +=
        fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3.5\" fill=\"{}\"/>\n", x.place(px), y.place(py), colour);
  }
  if (line.empty()) return {};
  if (!curve.joined) return marks;
  return fmt::format("<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.6\"{}/>\n", line, colour,
                     curve.dashed ? " stroke-dasharray=\"6 4\"" : "") +
         marks;
}

/// Texts beside points, each where no earlier one is, as far as there is such a place.
class Labels {
 public:
  std::string draw(const PlotCurve& curve, const char* colour, const Axis& x, const Axis& y) {
    std::string svg;
    for (std::size_t i = 0; i < std::min(curve.labels.size(), curve.points.size()); ++i) {
      const auto& [px, py] = curve.points[i];
      if (!x.shows(px) || !y.shows(py) || curve.labels[i].empty()) continue;
      const Box box = free_place(x.place(px), y.place(py), kLetter * static_cast<double>(curve.labels[i].size()));
      taken_.push_back(box);
      svg += text_at(box.left, box.top + kLine - 3.0, "start", curve.labels[i],
                     fmt::format(" fill=\"{}\" font-size=\"11\"", colour));
    }
    return svg;
  }

 private:
  struct Box {
    double left = 0.0, top = 0.0, width = 0.0;
  };
  static constexpr double kLetter = 6.0, kLine = 13.0, kGap = 6.0;

  bool is_free(const Box& box) const {
    if (box.left < kLeft || box.left + box.width > kRight || box.top < kTop || box.top + kLine > kBottom) return false;
    return std::none_of(taken_.begin(), taken_.end(), [&](const Box& other) {
      return box.left < other.left + other.width && other.left < box.left + box.width && box.top < other.top + kLine &&
             other.top < box.top + kLine;
    });
  }

  Box free_place(double at_x, double at_y, double width) const {
    const Box first{at_x + kGap, at_y - 0.5 * kLine, width};
    for (int line = 0; line < 20; ++line) {
      for (const double side : {-1.0, 1.0}) {
        for (const double left : {at_x + kGap, at_x - kGap - width}) {
          const Box box{left, at_y - 0.5 * kLine + side * line * kLine, width};
          if (is_free(box)) return box;
        }
      }
    }
    return first;
  }

  std::vector<Box> taken_;
};

}  // namespace

std::string to_svg(const LinePlot& plot) {
  Axis x(plot.log_x, kLeft, kRight);
  Axis y(plot.log_y, kBottom, kTop);
  for (const PlotCurve& curve : plot.curves) {
    for (const auto& [px, py] : curve.points) {
      if (!x.shows(px) || !y.shows(py)) continue;
      x.include(px);
      y.include(py);
    }
  }
  x.close();
  y.close();
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0:.0f} {1:.0f}\" width=\"{0:.0f}\" height=\"{1:.0f}\" "
      "role=\"img\" font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"{0:.0f}\" height=\"{1:.0f}\" "
      "fill=\"#fff\"/>\n",
      kWidth, kHeight);
  svg += draw_grid(x, y);
  svg += text_at(kLeft, 21.0, "start", plot.title, " font-weight=\"bold\"");
  svg += text_at(0.5 * (kLeft + kRight), kHeight - 14.0, "middle", plot.x_label);
  svg += text_at(0.0, 0.0, "middle", plot.y_label,
                 fmt::format(" transform=\"translate(16 {:.1f}) rotate(-90)\"", 0.5 * (kTop + kBottom)));
  double legend = kTop + 18.0;
  Labels labels;
  for (std::size_t k = 0; k < plot.curves.size(); ++k) {
    const char* colour = kColours[plot.curves[k].colour.value_or(k) % kColours.size()];
    svg += draw_curve(plot.curves[k], colour, x, y) + labels.draw(plot.curves[k], colour, x, y);
    if (plot.curves[k].name.empty()) continue;
    svg += text_at(kRight - 8.0, legend, "end", plot.curves[k].name, fmt::format(" fill=\"{}\"", colour));
    legend += 16.0;
  }
  return svg + "</svg>\n";
}

std::string escape_markup(std::string_view text) {
  std::string escaped;
  for (const char c : text) {
    switch (c) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      case '\'':
        escaped += "&#39;";
        break;
      default: {
        const auto code = static_cast<unsigned char>(c);
        escaped += code < 0x20 && c != '\n' && c != '\t' && c != '\r' ? '?' : c;
      }
    }
  }
  return escaped;
}

}  // namespace touchstone::plots
