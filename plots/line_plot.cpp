#include "plots/line_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "plots/plot_axis.h"

namespace touchstone::plots {
namespace {

constexpr double kHeight = 400.0;
constexpr double kTop = 34.0;
constexpr double kBottom = 346.0;

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
                       kPlotLeft, kPlotRight);
    svg += text_at(kPlotLeft - 6.0, at + 4.0, "end", fmt::format("{:.4g}", tick));
  }
  svg += fmt::format(
      "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"none\" stroke=\"#888\"/>\n", kPlotLeft,
      kTop, kPlotRight - kPlotLeft, kBottom - kTop);
  return svg;
}

/// What the curve's values spread over.
std::string draw_band(const PlotCurve& curve, const char* colour, const Axis& x, const Axis& y) {
  std::string above, below;
  for (std::size_t i = 0; i < std::min(curve.spread.size(), curve.points.size()); ++i) {
    const auto& [px, py] = curve.points[i];
    const double low = py - curve.spread[i], high = py + curve.spread[i];
    if (!x.shows(px) || !y.shows(low) || !y.shows(high)) continue;
    above += fmt::format(" {:.1f},{:.1f}", x.place(px), y.place(high));
    below = fmt::format(" {:.1f},{:.1f}", x.place(px), y.place(low)) + below;
  }
  if (above.empty()) return {};
  return fmt::format("<polygon points=\"{}{}\" fill=\"{}\" fill-opacity=\"0.2\"/>\n", above, below, colour);
}

std::string draw_curve(const PlotCurve& curve, const char* colour, const Axis& x, const Axis& y) {
  std::string line;
  std::string marks;
  for (const auto& [px, py] : curve.points) {
    if (!x.shows(px) || !y.shows(py)) continue;
    line += fmt::format("{}{:.1f},{:.1f}", line.empty() ? "" : " ", x.place(px), y.place(py));
    if (curve.dashed || !curve.marked) continue;
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
    if (box.left < kPlotLeft || box.left + box.width > kPlotRight || box.top < kTop || box.top + kLine > kBottom)
      return false;
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
  Axis x(plot.log_x, kPlotLeft, kPlotRight);
  Axis y(plot.log_y, kBottom, kTop);
  for (const PlotCurve& curve : plot.curves) {
    for (const auto& [px, py] : curve.points) {
      if (!x.shows(px) || !y.shows(py)) continue;
      x.include(px);
      y.include(py);
    }
    for (std::size_t i = 0; i < std::min(curve.spread.size(), curve.points.size()); ++i) {
      const auto& [px, py] = curve.points[i];
      if (!x.shows(px)) continue;
      for (const double end : {py - curve.spread[i], py + curve.spread[i]}) {
        if (y.shows(end)) y.include(end);
      }
    }
  }
  x.close();
  y.close();
  std::string svg = begun_svg(kHeight);
  svg += draw_grid(x, y);
  svg += text_at(kPlotLeft, 21.0, "start", plot.title, " font-weight=\"bold\"");
  svg += text_at(0.5 * (kPlotLeft + kPlotRight), kHeight - 14.0, "middle", plot.x_label);
  svg += text_at(0.0, 0.0, "middle", plot.y_label,
                 fmt::format(" transform=\"translate(16 {:.1f}) rotate(-90)\"", 0.5 * (kTop + kBottom)));
  double legend = kTop + 18.0;
  Labels labels;
  for (std::size_t k = 0; k < plot.curves.size(); ++k) {
    const char* colour = plot_colour(plot.curves[k].colour.value_or(k));
    svg += draw_band(plot.curves[k], colour, x, y) + draw_curve(plot.curves[k], colour, x, y) +
           labels.draw(plot.curves[k], colour, x, y);
    if (plot.curves[k].name.empty()) continue;
    svg += text_at(kPlotRight - 8.0, legend, "end", plot.curves[k].name, fmt::format(" fill=\"{}\"", colour));
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
