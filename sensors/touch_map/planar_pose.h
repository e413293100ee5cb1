#pragma once
// Poses of a flat touch: isometries of the plane, mm and radians, named `a_from_b` as in core/transform.h.

#include <Eigen/Core>
#include <cmath>
#include <span>

#include "core/units.h"

namespace touchstone::sensors {

/// A turn followed by a shift: p_a = R(angle) p_b + translation. A positive angle turns x towards y.
struct PlanarPose {
  double angle = 0.0;                                     ///< radians
  Eigen::Vector2d translation = Eigen::Vector2d::Zero();  ///< mm

  /// R(angle).
  Eigen::Matrix2d rotation() const {
    const double c = std::cos(angle), s = std::sin(angle);
    return (Eigen::Matrix2d() << c, -s, s, c).finished();
  }
  Eigen::Vector2d operator*(const Eigen::Vector2d& point) const { return rotation() * point + translation; }
  /// Of `other` first, then of this.
  PlanarPose operator*(const PlanarPose& other) const;
  /// p_b of p_a.
  PlanarPose inverse() const;
};

/// The same angle in (-pi, pi].
double wrapped(double angle);

/// The isometry that takes `from` to `to` with the least sum of squared distances ([Arun1987] in the plane: the angle
/// is that of the summed cross and dot products about the centroids).
/// @pre equally many points, at least two, not all in one place
PlanarPose least_squares_isometry(std::span<const Eigen::Vector2d> to, std::span<const Eigen::Vector2d> from);

/// Linear part A of the affine map to = A from + t with the least sum of squared distances. It is the thesis's
/// "rotation component of the homography" [Li2015, sec. 3.3.1]: a flat touch seen straight has no perspective, and
/// unlike a homography's its linear part doesn't depend on the origin. All zeros where the points lie on one line.
/// @pre equally many points
Eigen::Matrix2d least_squares_linear_part(std::span<const Eigen::Vector2d> to, std::span<const Eigen::Vector2d> from);

/// The thesis's confidence (eq. 2): c = max(1 - |1 - det R|, 0). 1 for every isometry.
double isometry_confidence(const Eigen::Matrix2d& linear_part);

}  // namespace touchstone::sensors
