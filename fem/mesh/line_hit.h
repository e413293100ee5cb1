#pragma once
// Where a line meets a triangle: one rule for all that look for it, so that they agree to the last bit.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <utility>

namespace touchstone::fem {

/// Two unit vectors across `direction`, also a unit vector.
inline std::pair<Eigen::Vector3d, Eigen::Vector3d> across(const Eigen::Vector3d& direction) {
  int smallest = 0;
  direction.cwiseAbs().minCoeff(&smallest);
  const Eigen::Vector3d first = direction.cross(Eigen::Vector3d::Unit(smallest)).normalized();
  return {first, direction.cross(first)};
}

/// A triangle that a line meets: `areas` over their `sum` are the barycentric coordinates of where.
struct LineHit {
  Eigen::Vector3d areas;
  double sum;
};

/// Of the line that is seen as the point (0, 0); `x` and `y` are the corners across it. Nothing if it misses. Edge
/// tests are inclusive and exactly antisymmetric, so no line slips between two triangles. A triangle that is seen
/// edge-on is missed: its neighbours are hit.
inline std::optional<LineHit> hit_in(const std::array<double, 3>& x, const std::array<double, 3>& y) {
  const double e0 = x[1] * y[2] - y[1] * x[2];
  const double e1 = x[2] * y[0] - y[2] * x[0];
  const double e2 = x[0] * y[1] - y[0] * x[1];
  const bool inside = (e0 >= 0 && e1 >= 0 && e2 >= 0) || (e0 <= 0 && e1 <= 0 && e2 <= 0);
  const double sum = e0 + e1 + e2;
  if (!inside || sum == 0.0) return std::nullopt;
  return LineHit{{e0, e1, e2}, sum};
}

/// Signed distance from `point` along the line to its hit in a triangle.
inline double distance_to(const LineHit& hit, const std::array<Eigen::Vector3d, 3>& corners,
                          const Eigen::Vector3d& point, const Eigen::Vector3d& direction) {
  return (hit.areas[0] * direction.dot(corners[0] - point) + hit.areas[1] * direction.dot(corners[1] - point) +
          hit.areas[2] * direction.dot(corners[2] - point)) /
         hit.sum;
}

}  // namespace touchstone::fem
