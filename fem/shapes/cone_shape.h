#pragma once

#include <Eigen/Core>
#include <optional>

namespace touchstone::fem {

/// A cone about the z axis with its tip down, in the origin, and a flat base in the plane z = height. A tip radius
/// above zero rounds the tip off by a ball that the cone touches all round; the ball's lowest point is then the origin.
/// It is convex. Object frame, mm.
struct ConeShape {
  double half_angle = 0.5;  ///< between axis and side, radians, above 0 and below pi/2
  double height = 1.0;      ///< from the lowest point to the base
  double tip_radius = 0.0;

  double apex() const;         ///< z at which the side, drawn on, meets the axis: at most 0
  double tip_height() const;   ///< z of the circle in which ball and side meet; 0 for a sharp tip
  double base_radius() const;  ///< at z = height
};

/// See fem/shapes/contact_shape.h.
std::optional<double> first_entry(const ConeShape& cone, const Eigen::Vector3d& point,
                                  const Eigen::Vector3d& direction);

/// Known along the axis only, where the silhouette is the base.
std::optional<double> silhouette_distance(const ConeShape& cone, const Eigen::Vector3d& point,
                                          const Eigen::Vector3d& direction);

}  // namespace touchstone::fem
