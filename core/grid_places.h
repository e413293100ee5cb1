#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>

namespace touchstone {

/// Calls visit(i, j, b, c) for each place with whole coordinates, 0 <= i < columns and 0 <= j < rows, that a triangle
/// of the plane holds, row by row: it is (1 - b - c) corner[0] + b corner[1] + c corner[2]. A place on an edge, to
/// 1e-9, belongs to the triangles on both sides. A triangle without area holds none.
template <typename Visit>
void for_places_in(const std::array<Eigen::Vector2d, 3>& corner, int columns, int rows, const Visit& visit) {
  constexpr double kOnEdge = 1e-9;
  const Eigen::Vector2d low = corner[0].cwiseMin(corner[1]).cwiseMin(corner[2]);
  const Eigen::Vector2d high = corner[0].cwiseMax(corner[1]).cwiseMax(corner[2]);
  if (high.x() < 0.0 || high.y() < 0.0 || low.x() > columns - 1 || low.y() > rows - 1) return;
  const Eigen::Vector2d one = corner[1] - corner[0];
  const Eigen::Vector2d other = corner[2] - corner[0];
  const double area = one.x() * other.y() - one.y() * other.x();
  if (area == 0.0) return;
  const int left = static_cast<int>(std::max(0.0, std::ceil(low.x() - kOnEdge)));
  const int right = static_cast<int>(std::min(columns - 1.0, std::floor(high.x() + kOnEdge)));
  const int top = static_cast<int>(std::max(0.0, std::ceil(low.y() - kOnEdge)));
  const int bottom = static_cast<int>(std::min(rows - 1.0, std::floor(high.y() + kOnEdge)));
  for (int j = top; j <= bottom; ++j) {
    for (int i = left; i <= right; ++i) {
      const Eigen::Vector2d d = Eigen::Vector2d(i, j) - corner[0];
      const double b = (d.x() * other.y() - d.y() * other.x()) / area;
      const double c = (one.x() * d.y() - one.y() * d.x()) / area;
      if (b < -kOnEdge || c < -kOnEdge || b + c > 1.0 + kOnEdge) continue;
      visit(i, j, b, c);
    }
  }
}

}  // namespace touchstone
