#include "fem/shapes/cone_shape.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "fem/shapes/line_interval.h"

namespace touchstone::fem {
namespace {

/// The part of the line inside the endless cone of slope `tangent` that opens upwards from `apex`; below the apex it
/// may also be of the cone's mirror image.
LineInterval inside_endless_cone(double tangent, double apex, const Eigen::Vector3d& p, const Eigen::Vector3d& d) {
  // rho <= tangent (z - apex): a t^2 + 2 b t + c <= 0. The products keep a's digits where the line is almost parallel
  // to the side.
  const double across = std::hypot(d.x(), d.y());
  const double up = tangent * d.z();
  const double w = tangent * (p.z() - apex);
  const double rho = std::hypot(p.x(), p.y());
  const double a = (across - up) * (across + up);
  const double b = p.x() * d.x() + p.y() * d.y() - up * w;
  const double c = (rho - w) * (rho + w);
  const double discriminant = b * b - a * c;
  if (a >= 0.0 && discriminant < 0.0) return {1.0, 0.0};
  // Without cancellation: the root of larger size first, the other from the roots' product. A root is infinite where
  // the line is parallel to the side.
  const double q = -(b + std::copysign(std::sqrt(std::max(0.0, discriminant)), b));
  if (q == 0.0) return a > 0.0 ? LineInterval{0.0, 0.0} : c > 0.0 ? LineInterval{1.0, 0.0} : LineInterval{};
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  double low = a == 0.0 ? std::copysign(kInfinity, q) : q / a;
  double high = c / q;
  if (low > high) std::swap(low, high);
  if (a >= 0.0) return {low, high};
  // A steep line is in the cone above one root, and in the mirror image below the other.
  return d.z() > 0.0 ? LineInterval{high, kInfinity} : LineInterval{-kInfinity, low};
}

}  // namespace

double ConeShape::apex() const {
  return tip_radius * (1.0 - 1.0 / std::sin(half_angle));
}

double ConeShape::tip_height() const {
  return tip_radius * (1.0 - std::sin(half_angle));
}

double ConeShape::base_radius() const {
  return (height - apex()) * std::tan(half_angle);
}

std::optional<double> first_entry(const ConeShape& cone, const Eigen::Vector3d& point, const Eigen::Vector3d& d) {
  // From the line's point nearest to the origin on, so that far points lose no digits.
  const double shift = -point.dot(d);
  const Eigen::Vector3d p = point + shift * d;
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  double enter = kInfinity;
  const LineInterval side = common(inside_endless_cone(std::tan(cone.half_angle), cone.apex(), p, d),
                                   between(cone.tip_height(), cone.height, p.z(), d.z()));
  if (!side.empty()) enter = side.enter;
  if (cone.tip_radius > 0.0) {
    const LineInterval tip = common(inside_ball(cone.tip_radius, p - cone.tip_radius * Eigen::Vector3d::UnitZ(), d),
                                    between(-kInfinity, cone.height, p.z(), d.z()));
    if (!tip.empty()) enter = std::min(enter, tip.enter);
  }
  if (enter == kInfinity) return std::nullopt;
  return shift + enter;
}

std::optional<double> silhouette_distance(const ConeShape& cone, const Eigen::Vector3d& p, const Eigen::Vector3d& d) {
  if (d.x() != 0.0 || d.y() != 0.0) return std::nullopt;
  return cone.base_radius() - std::hypot(p.x(), p.y());
}

}  // namespace touchstone::fem
