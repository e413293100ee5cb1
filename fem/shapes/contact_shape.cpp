#include "fem/shapes/contact_shape.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/error.h"
#include "core/units.h"
#include "fem/shapes/line_interval.h"

namespace touchstone::fem {
namespace {

constexpr int kReliefIterations = 40;
constexpr int kRimSteps = 200;
constexpr int kEllipseSteps = 60;  // some 5 do
constexpr double kAcross = 1e-6;   // cosine from which a disc is seen as an ellipse, not as a line
constexpr double kTouch = 1e-15;   // of the radius: rounding

void check_positive(double value, const char* what) {
  if (!(value > 0.0) || !std::isfinite(value)) fail("{} is {} mm, it must be above 0 and finite", what, value);
}

void check_one(const SphereShape& sphere) {
  check_positive(sphere.radius, "the sphere's radius");
}

void check_one(const RoundedCylinder& cylinder) {
  check_positive(cylinder.radius, "the cylinder's radius");
  check_positive(cylinder.height, "the cylinder's height");
  const double largest = std::min(cylinder.radius, cylinder.height);
  if (!(cylinder.edge_radius >= 0.0) || cylinder.edge_radius > largest) {
    fail("the cylinder's edge radius is {} mm, it must be from 0 to {}", cylinder.edge_radius, largest);
  }
}

void check_one(const BoxShape& box) {
  for (int a = 0; a < 3; ++a) check_positive(box.size[a], "the box's edge length");
}

void check_one(const MeshShape&) {}

void check_one(const EggShape& egg) {
  check_positive(egg.radius, "the egg's radius");
  check_positive(egg.blunt, "the egg's blunt half");
  check_positive(egg.sharp, "the egg's sharp half");
}

void check_one(const ShellShape& shell) {
  for (int a = 0; a < 2; ++a) check_positive(shell.size[a], "the shell's axis");
  check_positive(shell.thickness, "the shell's thickness");
  if (!shell.curvature.allFinite()) fail("the shell's curvatures must be finite");
}

void check_one(const ConeShape& cone) {
  if (!(cone.half_angle > 0.0 && cone.half_angle < 0.5 * kPi)) {
    fail("the cone's half angle is {} radians, it must be above 0 and below pi/2", cone.half_angle);
  }
  check_positive(cone.height, "the cone's height");
  if (!(cone.tip_radius >= 0.0 && cone.tip_height() < cone.height)) {
    fail("the cone's tip radius is {} mm, it must be at least 0 and below {}", cone.tip_radius,
         cone.height / (1.0 - std::sin(cone.half_angle)));
  }
}

void check_one(const TorusShape& torus) {
  check_positive(torus.radius, "the torus' radius");
  check_positive(torus.tube, "the torus' tube");
  if (torus.tube >= torus.radius) {
    fail("the torus' tube has a radius of {} mm, it must be below the ring's, {}", torus.tube, torus.radius);
  }
}

void check_one(const BarShape& bar) {
  check_positive(bar.radius, "the bar's radius");
  check_positive(bar.length, "the bar's length");
  if (bar.half_cylinder() < 0.0) {
    fail("the capsule's length is {} mm, it must be at least twice its radius, {}", bar.length, 2.0 * bar.radius);
  }
}

void check_one(const ReliefShape& shape) {
  TS_ASSERT(shape.relief != nullptr);
  std::visit([](const auto& body) { check_one(body); }, shape.base);
}

BoundingBall ball_of(const SphereShape& sphere) {
  return {Eigen::Vector3d::Zero(), sphere.radius};
}

BoundingBall ball_of(const RoundedCylinder& cylinder) {
  return {{0.0, 0.0, 0.5 * cylinder.height}, std::hypot(cylinder.radius, 0.5 * cylinder.height)};
}

BoundingBall ball_of(const BoxShape& box) {
  return {Eigen::Vector3d::Zero(), 0.5 * box.size.norm()};
}

BoundingBall ball_of(const MeshShape& shape) {
  const auto& vertices = shape.mesh().vertices;
  Eigen::Vector3d low = vertices.front();
  Eigen::Vector3d high = low;
  for (const auto& v : vertices) {
    low = low.cwiseMin(v);
    high = high.cwiseMax(v);
  }
  const Eigen::Vector3d centre = 0.5 * (low + high);
  double radius2 = 0.0;
  for (const auto& v : vertices) radius2 = std::max(radius2, (v - centre).squaredNorm());
  return {centre, std::sqrt(radius2)};
}

BoundingBall ball_of(const EggShape& egg) {
  const double middle = 0.5 * (egg.sharp - egg.blunt);
  double radius2 = 0.0;
  // Along each half the squared distance from the middle is a quadratic in y: it is largest at an end or where it
  // turns.
  for (const auto& [length, centre] : {std::pair(egg.sharp, middle), std::pair(egg.blunt, -middle)}) {
    const double bend = 1.0 - std::pow(egg.radius / length, 2);
    const double turn = bend < 0.0 ? std::clamp(centre / bend, 0.0, length) : 0.0;
    for (const double y : {0.0, turn, length}) {
      const double rho2 = egg.radius * egg.radius * (1.0 - std::pow(y / length, 2));
      radius2 = std::max(radius2, rho2 + (y - centre) * (y - centre));
    }
  }
  return {{0.0, middle, 0.0}, std::sqrt(radius2)};
}

BoundingBall ball_of(const ShellShape& shell) {
  const Eigen::Vector2d rise = 0.125 * shell.curvature.cwiseProduct(shell.size.cwiseProduct(shell.size));
  const double low = std::min(0.0, rise.minCoeff());
  const double high = std::max(0.0, rise.maxCoeff()) + shell.thickness;
  return {{0.0, 0.0, 0.5 * (low + high)}, std::hypot(0.5 * shell.size.maxCoeff(), 0.5 * (high - low))};
}

BoundingBall ball_of(const ConeShape& cone) {
  const double base = cone.base_radius();
  const double centre = std::min(cone.height, (base * base + cone.height * cone.height) / (2.0 * cone.height));
  // A rounded tip is farthest at its lowest point or where it ends.
  const double tip = std::hypot(cone.tip_radius * std::cos(cone.half_angle), cone.tip_height() - centre);
  return {{0.0, 0.0, centre}, std::max({centre, tip, std::hypot(base, cone.height - centre)})};
}

BoundingBall ball_of(const TorusShape& torus) {
  return {Eigen::Vector3d::Zero(), torus.radius + torus.tube};
}

BoundingBall ball_of(const BarShape& bar) {
  return {Eigen::Vector3d::Zero(), bar.round_ends ? 0.5 * bar.length : std::hypot(0.5 * bar.length, bar.radius)};
}

BoundingBall ball_of(const ReliefShape& shape) {
  const BoundingBall plain = std::visit([](const auto& body) { return ball_of(body); }, shape.base);
  return {plain.centre, plain.radius + shape.relief->highest()};
}

}  // namespace

void check_shape(const ContactShape& shape) {
  std::visit([](const auto& body) { check_one(body); }, shape);
}

bool is_convex(const ContactShape& shape) {
  return std::holds_alternative<SphereShape>(shape) || std::holds_alternative<RoundedCylinder>(shape) ||
         std::holds_alternative<BoxShape>(shape) || std::holds_alternative<EggShape>(shape) ||
         std::holds_alternative<ConeShape>(shape) || std::holds_alternative<BarShape>(shape);
}

std::optional<double> first_entry(const SphereShape& shape, const Eigen::Vector3d& p, const Eigen::Vector3d& d) {
  const LineInterval inside = inside_ball(shape.radius, p, d);
  if (inside.empty()) return std::nullopt;
  return inside.enter;
}

std::optional<double> first_entry(const BoxShape& shape, const Eigen::Vector3d& p, const Eigen::Vector3d& d) {
  LineInterval inside;
  for (int a = 0; a < 3; ++a) inside = common(inside, between(-0.5 * shape.size[a], 0.5 * shape.size[a], p[a], d[a]));
  if (inside.empty()) return std::nullopt;
  return inside.enter;
}

namespace {

/// How far a point of a line is outside of the rounded rim of a cylinder: the rounded body is a ball of radius r swept
/// over the core {rho <= core, z >= r}, so the distance to the core less r is convex along the line.
struct RimDistance {
  double t;
  double value, slope;
};

/// Nothing where the point isn't outside: in the rim, or beside the corner, where the sharp body is the rounded one.
/// @pre the point is in the sharp body
std::optional<RimDistance> rim_distance(const RoundedCylinder& shape, const Eigen::Vector3d& p,
                                        const Eigen::Vector3d& d, double t) {
  const double r = shape.edge_radius;
  const Eigen::Vector3d q = p + t * d;
  const double rho = std::sqrt(q.x() * q.x() + q.y() * q.y());
  const double out = rho - (shape.radius - r);
  const double below = r - q.z();
  if (out <= 0.0 || below <= 0.0) return std::nullopt;
  const double distance = std::sqrt(out * out + below * below);
  const double value = distance - r;
  if (value <= kTouch * shape.radius) return std::nullopt;
  return RimDistance{t, value, (out * (q.x() * d.x() + q.y() * d.y()) / rho - below * d.z()) / distance};
}

/// Where the tangents of two places meet: no value between them is lower. -infinity if they don't meet in between.
RimDistance lowest_of_tangents(const RimDistance& a, const RimDistance& b) {
  if (!(b.slope > a.slope)) return {0.5 * (a.t + b.t), -std::numeric_limits<double>::infinity(), 0.0};
  const double t = (a.value - b.value + b.slope * b.t - a.slope * a.t) / (b.slope - a.slope);
  return {t, a.value + a.slope * (t - a.t), 0.0};
}

}  // namespace

std::optional<double> first_entry(const RoundedCylinder& shape, const Eigen::Vector3d& p, const Eigen::Vector3d& d) {
  const double r = shape.edge_radius;
  const double core = shape.radius - r;
  if (d.x() * d.x() + d.y() * d.y() < 1e-30 && d.z() > 0.0) {  // along the axis, as a punch on a flat gel
    const double rho2 = p.x() * p.x() + p.y() * p.y();
    if (rho2 > shape.radius * shape.radius) return std::nullopt;
    if (rho2 <= core * core) return -p.z();
    const double out = std::sqrt(rho2) - core;
    return r - std::sqrt(std::max(0.0, (r - out) * (r + out))) - p.z();
  }
  const LineInterval inside = common(inside_cylinder(shape.radius, p, d), between(0.0, shape.height, p.z(), d.z()));
  if (inside.empty()) return std::nullopt;
  // Newton's steps from the sharp body's entry approach the first root from one side.
  double t = inside.enter;
  std::optional<RimDistance> at_leave;
  for (int iteration = 0; iteration < kRimSteps; ++iteration) {
    const std::optional<RimDistance> here = rim_distance(shape, p, d, t);
    if (!here) return t;
    if (here->slope >= 0.0) return std::nullopt;
    // A line that misses narrowly would take dozens of steps; the tangents from both ends tell at once.
    if (iteration == 1) at_leave = rim_distance(shape, p, d, inside.leave);
    if (at_leave && lowest_of_tangents(*here, *at_leave).value > kTouch * shape.radius) return std::nullopt;
    const double next = t - here->value / here->slope;
    if (next > inside.leave) return std::nullopt;
    if (next <= t) return t;
    t = next;
  }
  return t;
}

std::optional<double> first_entry(const MeshShape& shape, const Eigen::Vector3d& p, const Eigen::Vector3d& d) {
  return shape.first_entry(p, d);
}

std::optional<double> first_entry(const ReliefShape& shape, const Eigen::Vector3d& p, const Eigen::Vector3d& d) {
  // The plain body moved down by the height where the line will meet it: the same as the line moved up by that.
  const auto entry = [&](double height) {
    const Eigen::Vector3d lifted = p + height * Eigen::Vector3d::UnitZ();
    return std::visit([&](const auto& body) { return first_entry(body, lifted, d); }, shape.base);
  };
  std::optional<double> t = entry(0.0);
  if (!t || d.z() <= 0.0) return t;
  const bool tilted = d.x() != 0.0 || d.y() != 0.0;
  double height = 0.0;
  for (int iteration = 0; iteration < kReliefIterations; ++iteration) {
    const Eigen::Vector3d at = p + *t * d;
    const double found = shape.relief->at(at.x(), at.y());
    const double change = found - height;
    height += iteration < kReliefIterations / 2 ? change : 0.5 * change;
    const auto next = entry(height);
    if (!next) return t;  // at the very silhouette
    t = next;
    if (!tilted || std::abs(change) < 1e-10) break;
  }
  return t;
}

std::optional<double> first_entry(const ContactShape& shape, const Eigen::Vector3d& p, const Eigen::Vector3d& d) {
  return std::visit([&](const auto& body) { return first_entry(body, p, d); }, shape);
}

bool is_hit(const RoundedCylinder& shape, const Eigen::Vector3d& p, const Eigen::Vector3d& d) {
  if (d.x() * d.x() + d.y() * d.y() < 1e-30) return first_entry(shape, p, d).has_value();
  const LineInterval inside = common(inside_cylinder(shape.radius, p, d), between(0.0, shape.height, p.z(), d.z()));
  if (inside.empty()) return false;
  std::optional<RimDistance> first = rim_distance(shape, p, d, inside.enter);
  std::optional<RimDistance> last = rim_distance(shape, p, d, inside.leave);
  if (!first || !last) return true;
  for (int iteration = 0; iteration < kRimSteps; ++iteration) {
    if (first->slope >= 0.0 || last->slope <= 0.0) return false;
    const RimDistance between_them = lowest_of_tangents(*first, *last);
    if (between_them.value > kTouch * shape.radius) return false;
    if (!(between_them.t > first->t && between_them.t < last->t)) return false;  // they touch, to rounding
    const auto middle = rim_distance(shape, p, d, between_them.t);
    if (!middle) return true;
    (middle->slope < 0.0 ? first : last) = middle;
  }
  return false;
}

bool is_hit(const MeshShape& shape, const Eigen::Vector3d& p, const Eigen::Vector3d& d) {
  return shape.is_hit(p, d);
}

bool is_hit(const ReliefShape& shape, const Eigen::Vector3d& p, const Eigen::Vector3d& d) {
  return std::visit([&](const auto& base) { return is_hit(base, p, d); }, shape.base);
}

std::optional<double> silhouette_distance(const SphereShape& shape, const Eigen::Vector3d& p,
                                          const Eigen::Vector3d& d) {
  return shape.radius - (p - p.dot(d) * d).norm();
}

namespace {

/// From a point outside of an ellipse about the origin, its half axes `a` and `b`; 0 inside.
/// The nearest point is (a2 x / (t + a2), b2 y / (t + b2)) with t the largest root of a convex falling function, to
/// which Newton's steps from below come from one side. [Eberly2013, sec. 2]
double distance_outside_ellipse(double a, double b, double x, double y) {
  x = std::abs(x);
  y = std::abs(y);
  if (a == 0.0 || b == 0.0) return std::hypot(std::max(0.0, x - a), std::max(0.0, y - b));
  const double a2 = a * a;
  const double b2 = b * b;
  double t = std::max({0.0, a * x - a2, b * y - b2});
  for (int step = 0; step < kEllipseSteps; ++step) {
    const double u = a * x / (t + a2);
    const double v = b * y / (t + b2);
    const double value = u * u + v * v - 1.0;
    if (!(value > 0.0)) break;
    const double next = t + 0.5 * value / (u * u / (t + a2) + v * v / (t + b2));
    if (!(next > t)) break;
    t = next;
  }
  return t * std::hypot(x / (t + a2), y / (t + b2));
}

}  // namespace

std::optional<double> silhouette_distance(const RoundedCylinder& shape, const Eigen::Vector3d& p,
                                          const Eigen::Vector3d& d) {
  const double sine2 = d.x() * d.x() + d.y() * d.y();
  if (sine2 < 1e-30) return shape.radius - std::sqrt(p.x() * p.x() + p.y() * p.y());
  // The body is the disc of the core, z = r, in which a ball of radius r is swept, below the sharp cylinder above r.
  const double r = shape.edge_radius;
  const double core = shape.radius - r;
  const double cosine = std::abs(d.z());
  if (shape.height < 2.0 * r || cosine < kAcross) return std::nullopt;
  // Seen along d, with u along the axis as it is seen (towards +z) and v across it.
  const double sine = std::sqrt(sine2);
  const Eigen::Vector3d u_axis(-d.x() * d.z() / sine, -d.y() * d.z() / sine, sine);
  const double u = u_axis.dot(p - Eigen::Vector3d(0.0, 0.0, r));
  const double v = (d.x() * p.y() - d.y() * p.x()) / sine;
  // A disc of radius R is seen as an ellipse, R cosine by R; R cosine (1 - norm) is at most the distance to it.
  const double side = u - std::clamp(u, 0.0, (shape.height - r) * sine);
  const double sharp = cosine * shape.radius - std::hypot(side, cosine * v);
  if (r == 0.0) return sharp;
  const double in_core = cosine * core - std::hypot(u, cosine * v);
  const double rim = in_core >= 0.0 ? r + in_core : r - distance_outside_ellipse(cosine * core, core, u, v);
  return std::max(sharp, rim);
}

std::optional<double> silhouette_distance(const BoxShape& shape, const Eigen::Vector3d& p, const Eigen::Vector3d& d) {
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3;
    const int v = (axis + 2) % 3;
    if (d[u] == 0.0 && d[v] == 0.0) {
      return std::min(0.5 * shape.size[u] - std::abs(p[u]), 0.5 * shape.size[v] - std::abs(p[v]));
    }
  }
  return std::nullopt;
}

std::optional<double> silhouette_distance(const MeshShape&, const Eigen::Vector3d&, const Eigen::Vector3d&) {
  return std::nullopt;
}

std::optional<double> silhouette_distance(const ReliefShape& shape, const Eigen::Vector3d& p,
                                          const Eigen::Vector3d& d) {
  return std::visit([&](const auto& base) { return silhouette_distance(base, p, d); }, shape.base);
}

BoundingBall bounding_ball(const ContactShape& shape) {
  return std::visit([](const auto& body) { return ball_of(body); }, shape);
}

}  // namespace touchstone::fem
