#pragma once

#include <span>

namespace touchstone::lab {

/// y = offset + slope x, and the share of y's variance that it explains.
struct StraightLine {
  double slope = 0.0, offset = 0.0;
  double r2 = 0.0;  ///< 0 where all y are equal: then there's nothing to explain
};

/// By least squares in y. @pre as many x as y, at least two different x
StraightLine line_through(std::span<const double> x, std::span<const double> y);

}  // namespace touchstone::lab
