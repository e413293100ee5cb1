#include "fem/shapes/bar_shape.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "fem/shapes/line_interval.h"

namespace touchstone::fem {

std::optional<double> first_entry(const BarShape& bar, const Eigen::Vector3d& point, const Eigen::Vector3d& d) {
  // From the line's point nearest to the middle on, so that far points lose no digits.
  const double shift = -point.dot(d);
  const Eigen::Vector3d p = point + shift * d;
  const double half = bar.half_cylinder();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  double enter = kInfinity;
  const auto along_z = [](const Eigen::Vector3d& v) { return Eigen::Vector3d(v.y(), v.z(), v.x()); };
  const LineInterval side =
      common(inside_cylinder(bar.radius, along_z(p), along_z(d)), between(-half, half, p.x(), d.x()));
  if (!side.empty()) enter = side.enter;
  for (int end = -1; end <= 1 && bar.round_ends; end += 2) {
    const LineInterval ball = inside_ball(bar.radius, p - end * half * Eigen::Vector3d::UnitX(), d);
    if (!ball.empty()) enter = std::min(enter, ball.enter);
  }
  if (enter == kInfinity) return std::nullopt;
  return shift + enter;
}

std::optional<double> silhouette_distance(const BarShape& bar, const Eigen::Vector3d& p, const Eigen::Vector3d& d) {
  const double half = bar.half_cylinder();
  const double sine2 = d.y() * d.y() + d.z() * d.z();
  if (bar.round_ends) {
    // The line's distance from the segment that the ball is swept along: from the point of it nearest to the line.
    const double along = (p.x() - p.dot(d) * d.x()) / std::max(sine2, std::numeric_limits<double>::min());
    const Eigen::Vector3d from_segment = p - std::clamp(along, -half, half) * Eigen::Vector3d::UnitX();
    return bar.radius - (from_segment - from_segment.dot(d) * d).norm();
  }
  if (sine2 == 0.0) return bar.radius - std::hypot(p.y(), p.z());
  if (d.x() != 0.0) return std::nullopt;
  return std::min(bar.radius - std::abs(p.y() * d.z() - p.z() * d.y()), half - std::abs(p.x()));
}

}  // namespace touchstone::fem
