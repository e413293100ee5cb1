#pragma once

#include <string>
#include <utility>
#include <vector>

namespace touchstone::plots {

/// What something is called over time: each state from its x on until the next one's.
struct StateRow {
  std::string name;
  /// Rising in x. An empty text: no state, which isn't drawn.
  std::vector<std::pair<double, std::string>> states = {};
};

/// Rows of states under each other, over the x of a LinePlot of the same range.
struct StatePlot {
  std::string title;
  std::string x_label;
  double begin = 0.0, end = 0.0;  ///< of the axis; the last states end there
  std::vector<StateRow> rows;
};

/// The plot as one SVG element, 640 wide and as high as its rows need: a strip a row, a colour a state, their names in
/// those colours above it. Plain ASCII if the texts are.
std::string to_svg(const StatePlot& plot);

}  // namespace touchstone::plots
