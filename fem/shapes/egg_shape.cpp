#include "fem/shapes/egg_shape.h"

#include <cmath>
#include <limits>

#include "fem/shapes/line_interval.h"

namespace touchstone::fem {
namespace {

/// The part of the line inside the whole ellipsoid of which one half is the egg's.
LineInterval inside_ellipsoid(double radius, double half_length, const Eigen::Vector3d& p, const Eigen::Vector3d& d) {
  const Eigen::Vector3d scale(1.0 / radius, 1.0 / half_length, 1.0 / radius);
  const Eigen::Vector3d start = scale.cwiseProduct(p);
  const Eigen::Vector3d direction = scale.cwiseProduct(d);
  const double direction2 = direction.squaredNorm();
  const double middle = -start.dot(direction) / direction2;
  const double rest = 1.0 - (start + middle * direction).squaredNorm();
  if (rest < 0.0) return {1.0, 0.0};
  const double half = std::sqrt(rest / direction2);
  return {middle - half, middle + half};
}

}  // namespace

std::optional<double> first_entry(const EggShape& egg, const Eigen::Vector3d& p, const Eigen::Vector3d& d) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const LineInterval blunt =
      common(inside_ellipsoid(egg.radius, egg.blunt, p, d), between(-kInfinity, 0.0, p.y(), d.y()));
  const LineInterval sharp =
      common(inside_ellipsoid(egg.radius, egg.sharp, p, d), between(0.0, kInfinity, p.y(), d.y()));
  double enter = kInfinity;
  if (!blunt.empty()) enter = blunt.enter;
  if (!sharp.empty() && sharp.enter < enter) enter = sharp.enter;
  if (enter == kInfinity) return std::nullopt;
  return enter;
}

std::optional<double> silhouette_distance(const EggShape& egg, const Eigen::Vector3d& p, const Eigen::Vector3d& d) {
  if (d.x() != 0.0 || d.z() != 0.0) return std::nullopt;
  return egg.radius - std::hypot(p.x(), p.z());
}

}  // namespace touchstone::fem
