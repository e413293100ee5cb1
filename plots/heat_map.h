#pragma once
// A small plot of a figure over two variables as SVG.

#include <string>
#include <vector>

namespace touchstone::plots {

/// Values over a grid: one cell for each pair of x and y.
struct HeatMap {
  std::string title;
  std::string x_label, y_label;
  std::vector<double> x, y;                 ///< rising
  std::vector<std::vector<double>> values;  ///< values[i][j] at x[i], y[j]; what isn't finite has no colour
  std::vector<std::vector<bool>> marked;    ///< framed cells; empty: none
  bool logarithmic = false;                 ///< colours by the logarithm, if all values are above 0
};

/// The plot as one SVG element, 640 x 440, with its own colours and no outside resource: a cell a value, with the
/// value in it; dark is low. Plain ASCII if the labels are. @pre values are as many as x and y
std::string to_svg(const HeatMap& map);

}  // namespace touchstone::plots
