#pragma once
// The value that a share of some values is below.

#include <algorithm>
#include <cstddef>
#include <vector>

#include "core/error.h"

namespace touchstone::sensors {

/// Moves the value that `share` (0 to 1) of the values are below to its place in their order, and gives it: one of the
/// values, without interpolation. The others' order is lost. @pre there is a value
inline float quantile_of(std::vector<float>& values, double share) {
  TS_ASSERT(!values.empty());
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace touchstone::sensors
