#pragma once
// A small plot of curves as SVG: for the validation page and for benchmarks.

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace touchstone::plots {

/// A curve of one colour: points in the order in which they are joined, if they are, each marked.
struct PlotCurve {
  std::string name;  ///< in the legend; empty: none
  std::vector<std::pair<double, double>> points;
  bool dashed = false;                     ///< for theory: no marks
  bool joined = true;                      ///< by lines
  bool marked = true;                      ///< each point by a dot; not where there are hundreds
  std::vector<double> spread = {};         ///< of each point, up and down: a band behind the curve; or none
  std::optional<std::size_t> colour = {};  ///< number in the palette of six; none: as the curves' order
  std::vector<std::string> labels = {};    ///< beside the points, in their order, where no other label is; or none
};

/// Curves over one pair of axes; on a logarithmic axis only values above 0 are shown.
struct LinePlot {
  std::string title;
  std::string x_label;
  std::string y_label;
  bool log_x = true;
  bool log_y = true;
  std::vector<PlotCurve> curves;
};

/// The plot as one SVG element, 640 x 400, with its own colours and no outside resource. Points that aren't finite,
/// and those not above zero on a logarithmic axis, are left out. Plain ASCII if the labels are.
std::string to_svg(const LinePlot& plot);

/// The text with & < > " ' as HTML and XML want them; control characters but line ends and tabs become '?'.
std::string escape_markup(std::string_view text);

}  // namespace touchstone::plots
