#pragma once

#include <Eigen/Core>

#include "fem/shapes/contact_shape.h"
#include "sim/scene/device.h"

namespace touchstone::sim {

/// Height (gel frame's z, mm) of the object's origin at which it just touches the undeformed gel, coming straight down
/// over `place_mm` with this rotation (gel from object). All depths in this program are counted from here. Exact
/// where the lowest point of a sphere, a cylinder, a box or a mesh meets a slab; else found to about a micrometre by a
/// search over lines along z, which may miss detail finer than a fortieth of the shape's size.
/// @throws Error if the object isn't over the gel
double first_touch(const GelSpec& gel, const fem::ContactShape& shape, const Eigen::Vector2d& place_mm,
                   const Eigen::Matrix3d& rotation);

}  // namespace touchstone::sim
