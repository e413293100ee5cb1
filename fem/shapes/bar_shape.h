#pragma once

#include <Eigen/Core>
#include <optional>

namespace touchstone::fem {

/// A round bar along the x axis with its middle in the origin: a cylinder with flat ends, or a capsule, whose ends are
/// half balls. It is convex. Object frame, mm.
struct BarShape {
  double radius = 1.0;
  double length = 4.0;  ///< of the whole bar with its ends; of a capsule at least twice the radius
  bool round_ends = false;

  /// Half the length of the part that is a cylinder.
  double half_cylinder() const { return 0.5 * length - (round_ends ? radius : 0.0); }
};

/// See fem/shapes/contact_shape.h.
std::optional<double> first_entry(const BarShape& bar, const Eigen::Vector3d& point, const Eigen::Vector3d& direction);

/// Of a capsule known in every direction; of flat ends where the line is along an axis or crosses the x axis at a right
/// angle.
std::optional<double> silhouette_distance(const BarShape& bar, const Eigen::Vector3d& point,
                                          const Eigen::Vector3d& direction);

}  // namespace touchstone::fem
