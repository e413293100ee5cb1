#include "fem/shapes/shell_shape.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "fem/shapes/line_interval.h"

namespace touchstone::fem {
namespace {

/// The least root of a t^2 + b t + c in [low, high].
std::optional<double> first_root(double a, double b, double c, double low, double high) {
  const double discriminant = b * b - 4.0 * a * c;
  if (discriminant < 0.0) return std::nullopt;
  // Without cancellation: the root of larger size first, the other from the roots' product.
  const double q = -0.5 * (b + std::copysign(std::sqrt(discriminant), b));
  double first = std::numeric_limits<double>::infinity();
  for (const double root :
       {q / a, c / q}) {  // one may be infinite or no number, where the equation is linear or c is 0
    if (root >= low && root <= high) first = std::min(first, root);
  }
  if (std::isinf(first)) return std::nullopt;
  return first;
}

}  // namespace

std::optional<double> first_entry(const ShellShape& shell, const Eigen::Vector3d& point, const Eigen::Vector3d& d) {
  // From the line's point nearest to the origin on, so that far points lose no digits.
  const double shift = -point.dot(d);
  const Eigen::Vector3d p = point + shift * d;
  const Eigen::Vector3d scale(2.0 / shell.size.x(), 2.0 / shell.size.y(), 1.0);
  const LineInterval inside = inside_cylinder(1.0, scale.cwiseProduct(p), scale.cwiseProduct(d));
  if (inside.empty()) return std::nullopt;
  const Eigen::Vector2d& curvature = shell.curvature;
  // Height above the lower face: a t^2 + b t + c.
  const double a = -0.5 * (curvature.x() * d.x() * d.x() + curvature.y() * d.y() * d.y());
  const double b = d.z() - curvature.x() * p.x() * d.x() - curvature.y() * p.y() * d.y();
  const double c = p.z() - shell.lower_face(p.x(), p.y());
  if (std::isinf(inside.enter)) {  // straight up or down
    return shift + ((d.z() > 0.0 ? 0.0 : shell.thickness) - c) / b;
  }
  const double height = (a * inside.enter + b) * inside.enter + c;
  if (height >= 0.0 && height <= shell.thickness) return shift + inside.enter;  // through the rim
  const double level = height < 0.0 ? 0.0 : shell.thickness;
  const auto root = first_root(a, b, c - level, inside.enter, inside.leave);
  if (!root) return std::nullopt;
  return shift + *root;
}

std::optional<double> silhouette_distance(const ShellShape& shell, const Eigen::Vector3d& p, const Eigen::Vector3d& d) {
  if (d.x() != 0.0 || d.y() != 0.0) return std::nullopt;
  const double part = std::hypot(2.0 * p.x() / shell.size.x(), 2.0 * p.y() / shell.size.y());
  return 0.5 * shell.size.minCoeff() * (1.0 - part);
}

}  // namespace touchstone::fem
