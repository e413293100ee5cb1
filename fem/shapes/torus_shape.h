#pragma once

#include <Eigen/Core>
#include <optional>

namespace touchstone::fem {

/// A ring of a round tube, lying flat about the z axis with its centre in the origin. Not convex. Object frame, mm.
struct TorusShape {
  double radius = 1.0;  ///< of the circle that is the tube's middle
  double tube = 0.25;   ///< the tube's radius, below `radius`
};

/// See fem/shapes/contact_shape.h.
std::optional<double> first_entry(const TorusShape& torus, const Eigen::Vector3d& point,
                                  const Eigen::Vector3d& direction);

/// Known along the z axis only.
std::optional<double> silhouette_distance(const TorusShape& torus, const Eigen::Vector3d& point,
                                          const Eigen::Vector3d& direction);

}  // namespace touchstone::fem
