#include "fem/shapes/torus_shape.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/units.h"
#include "fem/shapes/line_interval.h"

namespace touchstone::fem {
namespace {

constexpr int kMostSteps = 200;  // some 6 do
constexpr double kRounding = 2.0 * std::numeric_limits<double>::epsilon();

/// Distance from the surface, below zero inside, along a line.
struct TubeDistance {
  double value, slope;
};
TubeDistance tube_distance(const TorusShape& torus, const Eigen::Vector3d& p, const Eigen::Vector3d& d, double t) {
  const Eigen::Vector3d q = p + t * d;
  const double rho = std::hypot(q.x(), q.y());
  const double out = rho - torus.radius;
  const double from_middle = std::hypot(out, q.z());
  return {from_middle - torus.tube, (out * (q.x() * d.x() + q.y() * d.y()) / rho + q.z() * d.z()) / from_middle};
}

/// The real roots of s^3 + a s + b, rising; NaN where there is but one, which comes first.
std::array<double, 3> roots_of_cubic(double a, double b) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const double discriminant = 0.25 * b * b + a * a * a / 27.0;
  if (discriminant >= 0.0) {
    const double u = -std::copysign(std::cbrt(0.5 * std::abs(b) + std::sqrt(discriminant)), b);
    return {u == 0.0 ? 0.0 : u - a / (3.0 * u), kNone, kNone};
  }
  const double size = 2.0 * std::sqrt(-a / 3.0);
  const double angle = std::acos(std::clamp(3.0 * b / (a * size), -1.0, 1.0)) / 3.0;
  return {size * std::cos(angle + 2.0 * kPi / 3.0), size * std::cos(angle - 2.0 * kPi / 3.0), size * std::cos(angle)};
}

/// Where the distance, above zero at `low` and not at `high`, is zero; Newton's steps, halving where they leave.
/// @pre it has one zero in between
double zero_between(const TorusShape& torus, const Eigen::Vector3d& p, const Eigen::Vector3d& d, double low,
                    double high) {
  double t = low;
  for (int step = 0; step < kMostSteps; ++step) {
    const TubeDistance here = tube_distance(torus, p, d, t);
    if (here.value == 0.0) return t;
    (here.value > 0.0 ? low : high) = t;
    double next = t - here.value / here.slope;
    if (!(next > low && next < high)) next = 0.5 * (low + high);  // also for a slope that isn't a number
    if (std::abs(next - t) <= kRounding * (std::abs(t) + torus.radius)) return next;
    t = next;
  }
  return t;
}

}  // namespace

std::optional<double> first_entry(const TorusShape& torus, const Eigen::Vector3d& point, const Eigen::Vector3d& d) {
  // From the line's point nearest to the centre on, so that far points lose no digits.
  const double shift = -point.dot(d);
  const Eigen::Vector3d p = point + shift * d;
  const double r = torus.tube;
  if (d.x() * d.x() + d.y() * d.y() < 1e-30) {
    const double out = std::hypot(point.x(), point.y()) - torus.radius;
    if (std::abs(out) > r) return std::nullopt;
    return shift - p.z() / d.z() - std::sqrt((r - out) * (r + out));
  }
  const double reach = torus.radius + r;
  const double rest = reach * reach - p.squaredNorm();
  if (rest < 0.0) return std::nullopt;
  const LineInterval inside = common({-std::sqrt(rest), std::sqrt(rest)}, between(-r, r, p.z(), d.z()));
  if (inside.empty()) return std::nullopt;
  double low = inside.enter;
  if (tube_distance(torus, p, d, low).value <= 0.0) return shift + low;
  // Inside the torus f(t) = (t^2 + k)^2 - 4 radius^2 (a t^2 + 2 b t + c) is below zero. Between the places where f
  // turns, it has one zero at most.
  const double radius2 = torus.radius * torus.radius;
  const double k = p.squaredNorm() + radius2 - r * r;
  const double a = d.x() * d.x() + d.y() * d.y();
  const double b = p.x() * d.x() + p.y() * d.y();
  const std::array<double, 3> turn = roots_of_cubic(k - 2.0 * radius2 * a, -2.0 * radius2 * b);
  for (const int least : {0, 2}) {  // f is lowest there; between them it is highest
    if (std::isnan(turn[least])) break;
    const double bottom = std::min(turn[least], inside.leave);
    if (bottom > low && tube_distance(torus, p, d, bottom).value <= 0.0) {
      return shift + zero_between(torus, p, d, low, bottom);
    }
    if (!std::isnan(turn[1])) low = std::max(low, std::min(turn[1], inside.leave));
  }
  return std::nullopt;
}

std::optional<double> silhouette_distance(const TorusShape& torus, const Eigen::Vector3d& p, const Eigen::Vector3d& d) {
  if (d.x() != 0.0 || d.y() != 0.0) return std::nullopt;
  return torus.tube - std::abs(std::hypot(p.x(), p.y()) - torus.radius);
}

}  // namespace touchstone::fem
