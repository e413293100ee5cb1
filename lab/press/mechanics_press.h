#pragma once
// The presses of the validation's rows, in the fewest words.

#include <cmath>
#include <vector>

#include "fem/contact/press.h"

namespace touchstone::lab {

/// Upright, its object frame's origin at (x, y, z).
inline fem::PressTarget press_target(double x, double y, double z) {
  fem::PressTarget target;
  target.axis = {fem::AxisControl::at(x), fem::AxisControl::at(y), fem::AxisControl::at(z)};
  return target;
}

/// |value / expected - 1|.
inline double relative_error(double value, double expected) {
  return std::abs(value / expected - 1.0);
}

/// Without friction, a little beside the mesh's own symmetry.
double normal_force(const fem::Compliance& gel, fem::ContactShape shape, double z);

/// Force of a sharp flat punch of this radius, pressed to `depth`: the mean over 16 places on a mesh of these edges. A
/// sharp edge's pressure is infinite, and where the edge cuts the mesh moves the force by some percent.
double mean_flat_punch(const fem::Compliance& gel, double radius, double depth, double edge);

/// The mean force of a flat punch where edges have no length: from two meshes, the first with edges twice as long as
/// the second, the error being of first order there. One mesh: its own force.
double extrapolated(const std::vector<double>& forces);

}  // namespace touchstone::lab
