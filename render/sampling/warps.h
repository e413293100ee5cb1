#pragma once
// Maps from the unit square to the shapes that light is sampled over, and the frame round a normal.

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "core/units.h"

namespace touchstone::render {

/// Of one angle.
struct SineCosine {
  double sine, cosine;
};

/// Of an angle within -pi/4 and pi/4, by Taylor's series to 1e-11: a map of random numbers needs no more.
inline SineCosine sine_cosine_within_octant(double angle) {
  const double x = angle * angle;
  const double sine = 1.0 + x * (-1.0 / 6 + x * (1.0 / 120 + x * (-1.0 / 5040 + x * (1.0 / 362880 - x / 39916800))));
  const double cosine =
      1.0 + x * (-0.5 + x * (1.0 / 24 + x * (-1.0 / 720 + x * (1.0 / 40320 - x * (1.0 / 3628800 - x / 479001600)))));
  return {angle * sine, cosine};
}

/// Uniform on the unit disc, area-preserving and continuous [Shirley1997].
inline Eigen::Vector2d square_to_disc(double u, double v) {
  const double a = 2.0 * u - 1.0;
  const double b = 2.0 * v - 1.0;
  if (a == 0.0 && b == 0.0) return {0.0, 0.0};
  const bool lies_flat = std::abs(a) > std::abs(b);
  const double radius = lies_flat ? a : b;
  const auto [sine, cosine] = sine_cosine_within_octant(0.25 * kPi * ((lies_flat ? b : a) / radius));
  return {radius * (lies_flat ? cosine : sine), radius * (lies_flat ? sine : cosine)};
}

/// A direction about +z with density cos(theta) / pi (Malley's method).
inline Eigen::Vector3d square_to_cosine_hemisphere(double u, double v) {
  const Eigen::Vector2d disc = square_to_disc(u, v);
  return {disc.x(), disc.y(), std::sqrt(std::max(0.0, 1.0 - disc.squaredNorm()))};
}

/// A right-handed orthonormal frame whose third axis is a given unit vector [Duff2017].
struct NormalFrame {
  Eigen::Vector3d x, y, z;

  /// Any two axes beside the normal, which is a unit vector.
  explicit NormalFrame(const Eigen::Vector3d& normal) : z(normal) {
    const double sign = std::copysign(1.0, normal.z());
    const double a = -1.0 / (sign + normal.z());
    const double b = normal.x() * normal.y() * a;
    x = {1.0 + sign * normal.x() * normal.x() * a, sign * b, -sign * normal.x()};
    y = {b, sign + normal.y() * normal.y() * a, -normal.y()};
  }
  Eigen::Vector3d to_world(const Eigen::Vector3d& v) const { return v.x() * x + v.y() * y + v.z() * z; }
  Eigen::Vector3d to_local(const Eigen::Vector3d& v) const { return {v.dot(x), v.dot(y), v.dot(z)}; }
};

}  // namespace touchstone::render
