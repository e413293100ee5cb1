#pragma once
// Normal pressure on the touched face of an object, over the object frame's x and y.

#include <Eigen/Core>
#include <array>
#include <vector>

namespace touchstone::sim {

/// Pressure at the gel's surface vertices where they now are on the object, linear between them; overlaps in x and y
/// don't occur, since the gel's surface is a sheet on the object's lower side.
struct ContactPressure {
  std::vector<Eigen::Vector2d> places;  ///< mm, object frame
  std::vector<double> kPa;              ///< 0 where the object isn't touched
  std::vector<std::array<int, 3>> triangles;

  /// On a grid of `columns` x `rows` pixels of `pixel_mm` whose corner is `low`: at their middles, row by row along +y.
  std::vector<double> on_grid(const Eigen::Vector2d& low, double pixel_mm, int columns, int rows) const;
};

}  // namespace touchstone::sim
