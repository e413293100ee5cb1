#include "lab/statistics/straight_line.h"

#include <cstddef>

#include "core/error.h"

namespace touchstone::lab {

StraightLine line_through(std::span<const double> x, std::span<const double> y) {
  TS_ASSERT(x.size() == y.size() && x.size() >= 2);
  const auto n = static_cast<double>(x.size());
  double mean_x = 0.0;
  double mean_y = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    mean_x += x[i] / n;
    mean_y += y[i] / n;
  }
  double xx = 0.0;
  double xy = 0.0;
  double yy = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    xx += (x[i] - mean_x) * (x[i] - mean_x);
    xy += (x[i] - mean_x) * (y[i] - mean_y);
    yy += (y[i] - mean_y) * (y[i] - mean_y);
  }
  TS_ASSERT(xx > 0.0);
  StraightLine line;
  line.slope = xy / xx;
  line.offset = mean_y - line.slope * mean_x;
  line.r2 = yy > 0.0 ? xy * xy / (xx * yy) : 0.0;
  return line;
}

}  // namespace touchstone::lab
