#include "fem/shapes/line_interval.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace touchstone::fem {

LineInterval common(const LineInterval& a, const LineInterval& b) {
  return {std::max(a.enter, b.enter), std::min(a.leave, b.leave)};
}

LineInterval between(double low, double high, double start, double slope) {
  if (slope == 0.0) return start < low || start > high ? LineInterval{1.0, 0.0} : LineInterval{};
  double a = (low - start) / slope;
  double b = (high - start) / slope;
  if (a > b) std::swap(a, b);
  return {a, b};
}

LineInterval inside_ball(double radius, const Eigen::Vector3d& p, const Eigen::Vector3d& d) {
  const double middle = -p.dot(d);
  const double rest = radius * radius - (p + middle * d).squaredNorm();
  if (rest < 0.0) return {1.0, 0.0};
  const double half = std::sqrt(rest);
  return {middle - half, middle + half};
}

LineInterval inside_cylinder(double radius, const Eigen::Vector3d& p, const Eigen::Vector3d& d) {
  const double across2 = d.x() * d.x() + d.y() * d.y();
  const double along = p.x() * d.x() + p.y() * d.y();
  if (across2 < 1e-30) {
    return p.x() * p.x() + p.y() * p.y() > radius * radius ? LineInterval{1.0, 0.0} : LineInterval{};
  }
  const double middle = -along / across2;
  // The line's distance from the axis by a cross product, which doesn't cancel for far points.
  const double cross = p.x() * d.y() - p.y() * d.x();
  const double rest = radius * radius - cross * cross / across2;
  if (rest < 0.0) return {1.0, 0.0};
  const double half = std::sqrt(rest / across2);
  return {middle - half, middle + half};
}

}  // namespace touchstone::fem
