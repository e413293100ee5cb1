#pragma once
// The presses of the validation's rows, in the fewest words.

#include <cmath>

#include "fem/press.h"

namespace touchstone::lab {

/// Upright, its object frame's origin at (x, y, z).
inline fem::PressTarget press_target(double x, double y, double z) {
  fem::PressTarget target;
  target.axis = {fem::AxisControl::at(x), fem::AxisControl::at(y), fem::AxisControl::at(z)};
  return target;
}

inline double relative_error(double value, double expected) {
  return std::abs(value / expected - 1.0);
}

/// Without friction, a little beside the mesh's own symmetry.
inline double normal_force(const fem::Compliance& gel, const fem::ContactShape& shape, double z) {
  return fem::Press(gel, shape, 0.0).step(press_target(0.013, 0.021, z)).wrench[2];
}

}  // namespace touchstone::lab
