#pragma once

#include <Eigen/Core>
#include <optional>

namespace touchstone::fem {

/// An egg: two half ellipsoids of revolution about the y axis that meet at their common equator in the plane y = 0,
/// where they have the same tangents. It is convex. Object frame, mm; the origin is the equator's centre.
struct EggShape {
  double radius = 1.0;  ///< of the equator
  double blunt = 1.0;   ///< from the equator to the end at -y
  double sharp = 1.0;   ///< from the equator to the end at +y
};

/// See fem/shapes/contact_shape.h.
std::optional<double> first_entry(const EggShape& egg, const Eigen::Vector3d& point, const Eigen::Vector3d& direction);

/// Known along the axis only, where the silhouette is the equator.
std::optional<double> silhouette_distance(const EggShape& egg, const Eigen::Vector3d& point,
                                          const Eigen::Vector3d& direction);

}  // namespace touchstone::fem
