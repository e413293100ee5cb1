#pragma once

#include <Eigen/Core>

namespace touchstone {

/// The sign (-1, 0, 1) of the volume of the tetrahedron a, b, c, d: positive if d lies on the side of the plane abc
/// from which a, b, c run clockwise. Exact: doubtful cases are worked out without rounding (expansions after
/// [Shewchuk1997]).
/// @pre coordinates are finite and between about 1e-90 and 1e90 in size, or 0
int side_of_plane(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                  const Eigen::Vector3d& d);

/// The sign of the area of the triangle a, b, c in the plane: positive if they run counter-clockwise. Exact.
int side_of_line(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c);

}  // namespace touchstone
