#pragma once

#include <string>
#include <vector>

namespace touchstone::plots {

/// How often values fall where.
struct HistogramPlot {
  std::string title;
  std::string x_label;
  std::vector<double> values;
  int bins = 24;  ///< at most; fewer where there are fewer than four values a bin
};

/// The plot as one SVG element of 320 x 220 with its own colours and no outside resource: bars with the count's axis,
/// below the number of values, their range and mean. Values that aren't finite are left out and counted.
std::string to_svg(const HistogramPlot& plot);

}  // namespace touchstone::plots
