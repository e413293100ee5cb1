#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

namespace touchstone::fem {

/// The largest stretch-like gradient of a surface displacement (n x 3, mm, P1 on `triangles`): the greatest singular
/// value of the 3 x 2 displacement gradient within any triangle. It holds the surface strains and the surface's tilt,
/// so it bounds both from above; linear elasticity and small-slope contact are first-order in it.
double largest_surface_gradient(std::span<const Eigen::Vector3d> vertices,
                                std::span<const std::array<int, 3>> triangles, const Eigen::MatrixX3d& displacement);

}  // namespace touchstone::fem
