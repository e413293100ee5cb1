#include "plots/state_plot.h"

#include <fmt/format.h>

#include <algorithm>

#include "plots/plot_axis.h"

namespace touchstone::plots {
namespace {

constexpr double kRowsTop = 34.0;
constexpr double kRowHeight = 32.0;
constexpr double kStripHeight = 12.0;
constexpr double kStateLetter = 6.2;  // mean width of one, px

std::string draw_row(const StateRow& row, double end, const Axis& x, double top) {
  std::vector<std::string> names;  // in the order in which they come
  std::string svg = text_at(kPlotLeft, top + 11.0, "start", row.name);
  const auto number_of = [&](const std::string& name) {
    const auto known = std::find(names.begin(), names.end(), name);
    if (known != names.end()) return static_cast<std::size_t>(known - names.begin());
    names.push_back(name);
    return names.size() - 1;
  };
  for (std::size_t i = 0; i < row.states.size();) {
    const auto& [from, name] = row.states[i];
    std::size_t next = i + 1;
    while (next < row.states.size() && row.states[next].second == name) ++next;
    const double until = next < row.states.size() ? row.states[next].first : end;
    if (!name.empty()) {
      const double left = x.place(from);
      svg += fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"{}\"/>\n", left,
                         top + 16.0, std::max(0.7, x.place(until) - left), kStripHeight, plot_colour(number_of(name)));
    }
    i = next;
  }
  double right = kPlotRight;
  for (std::size_t i = names.size(); i > 0; --i) {
    svg += text_at(right, top + 11.0, "end", names[i - 1], fmt::format(" fill=\"{}\"", plot_colour(i - 1)));
    right -= kStateLetter * static_cast<double>(names[i - 1].size()) + 12.0;
  }
  return svg;
}

}  // namespace

std::string to_svg(const StatePlot& plot) {
  const double bottom = kRowsTop + kRowHeight * static_cast<double>(plot.rows.size()) + 4.0;
  Axis x(false, kPlotLeft, kPlotRight);
  x.include(plot.begin);
  x.include(plot.end);
  x.close();
  std::string svg = begun_svg(bottom + 46.0);
  svg += text_at(kPlotLeft, 21.0, "start", plot.title, " font-weight=\"bold\"");
  for (const double tick : x.ticks()) {
    const double at = x.place(tick);
    svg += fmt::format("<line x1=\"{0:.1f}\" y1=\"{1:.1f}\" x2=\"{0:.1f}\" y2=\"{2:.1f}\" stroke=\"#ddd\"/>\n", at,
                       kRowsTop, bottom);
    svg += text_at(at, bottom + 15.0, "middle", fmt::format("{:.4g}", tick));
  }
  for (std::size_t i = 0; i < plot.rows.size(); ++i) {
    svg += draw_row(plot.rows[i], plot.end, x, kRowsTop + kRowHeight * static_cast<double>(i));
  }
  svg += text_at(0.5 * (kPlotLeft + kPlotRight), bottom + 34.0, "middle", plot.x_label);
  return svg + "</svg>\n";
}

}  // namespace touchstone::plots
