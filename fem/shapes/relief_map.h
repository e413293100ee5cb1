#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace touchstone::fem {

/// Heights over a plane, mm: given at points of a rectangular grid, bilinear between them. Along each axis the map is
/// either repeated without end, or finite: then it is zero beyond one spacing outside of its outermost points.
class ReliefMap {
 public:
  /// `heights`: nx * ny, x fastest, the first at `first`. A repeated axis of n points has the period n * spacing.
  /// @throws Error for a size that doesn't fit, a spacing that isn't above zero, or a height that isn't finite or is
  /// below zero
  ReliefMap(int nx, int ny, Eigen::Vector2d first, Eigen::Vector2d spacing, std::array<bool, 2> repeated,
            std::vector<float> heights);

  /// Height over a place of the plane, mm.
  double at(double x, double y) const;
  double highest() const { return highest_; }

  /// The map as seen through a window of triangular weight, `width` (mm) from its middle to its end: what a mesh with
  /// edges of `width` can resolve of it. Detail below is averaged away.
  ReliefMap blurred(double width) const;

 private:
  int nx_, ny_;
  Eigen::Vector2d first_, spacing_;
  std::array<bool, 2> repeated_;
  std::vector<float> heights_;
  double highest_ = 0.0;
};

}  // namespace touchstone::fem
