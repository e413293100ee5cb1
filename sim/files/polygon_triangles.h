#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

namespace touchstone::sim {

/// Cuts a polygon into triangles whose corners are the polygon's and run round as it does; numbers are places in
/// `corners`. It may be hollow, slightly bent, and have corners in the middle of straight sides: no triangle is flat
/// that needn't be. Nothing if its outline crosses itself or has no area. Takes time as the cube of the number of
/// corners.
std::vector<std::array<int, 3>> polygon_triangles(std::span<const Eigen::Vector3d> corners);

}  // namespace touchstone::sim
