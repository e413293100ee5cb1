#pragma once

#include <Eigen/Core>
#include <optional>

namespace touchstone::fem {

/// A thin shell over an ellipse: the points s(x, y) <= z <= s(x, y) + thickness with s = (c_x x^2 + c_y y^2) / 2 and
/// (2 x / size_x)^2 + (2 y / size_y)^2 <= 1. Curvatures of opposite signs make a saddle, as a potato chip's; without
/// curvature it is a flat leaf. Not convex. Object frame, mm; the origin is the middle of the lower face.
struct ShellShape {
  Eigen::Vector2d size = Eigen::Vector2d::Ones();       ///< the ellipse's whole axes
  double thickness = 1.0;                               ///< along z
  Eigen::Vector2d curvature = Eigen::Vector2d::Zero();  ///< 1/mm, along x and y; above zero: its rim is higher

  /// s(x, y), also outside of the ellipse.
  double lower_face(double x, double y) const { return 0.5 * (curvature.x() * x * x + curvature.y() * y * y); }
};

/// See fem/shapes/contact_shape.h.
std::optional<double> first_entry(const ShellShape& shell, const Eigen::Vector3d& point,
                                  const Eigen::Vector3d& direction);

/// Known along z only. A lower bound of the distance to the ellipse, exact in sign and on the ellipse.
std::optional<double> silhouette_distance(const ShellShape& shell, const Eigen::Vector3d& point,
                                          const Eigen::Vector3d& direction);

}  // namespace touchstone::fem
