#include "fem/press.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "core/error.h"
#include "fem/press_part.h"
#include "fem/press_report.h"

namespace touchstone::fem {
namespace {

constexpr double kAsGoodAsInfinite = 100.0;  // for an infinite friction whose sets cycle
constexpr int kBondedHalvings = 1;

using Kind = AxisControl::Kind;

/// A straight way: positions and rotation from `start` to `to`, forces from `start.force` to `force`.
struct Path {
  PressSnapshot start;
  RigidTransform to;
  std::array<bool, 3> forced;
  Eigen::Vector3d force;
};

struct Effort {
  PartEffort part;
  int parts = 0;
};

}  // namespace

RigidTransform between(const RigidTransform& a, const RigidTransform& b, double fraction) {
  if (fraction >= 1.0) return b;
  RigidTransform result;
  result.translation = a.translation + fraction * (b.translation - a.translation);
  result.rotation = a.rotation;
  if (a.rotation != b.rotation) {
    result.rotation = Eigen::Quaterniond(a.rotation).slerp(fraction, Eigen::Quaterniond(b.rotation)).toRotationMatrix();
  }
  return result;
}

void check_target(const PressTarget& target) {
  const char* const names[] = {"x", "y", "z"};
  for (int a = 0; a < 3; ++a) {
    if (!std::isfinite(target.axis[a].value)) {
      fail("the {} {} of the press is {}, it must be finite", names[a],
           target.axis[a].kind == Kind::force ? "force" : "position", target.axis[a].value);
    }
  }
  if (!target.rotation.allFinite()) fail("the object's rotation holds NaN or infinity");
  const double error = (target.rotation.transpose() * target.rotation - Eigen::Matrix3d::Identity()).norm();
  if (error > 1e-6 || target.rotation.determinant() < 0.0) {
    fail("the object's rotation isn't one: R^T R differs from 1 by {:.3g}, det R = {:.3g}", error,
         target.rotation.determinant());
  }
  if (target.axis[2].kind == Kind::force && target.axis[2].value < 0.0) {
    fail("a normal force of {} N is wanted: contact can't pull, it must be at least 0", target.axis[2].value);
  }
}

struct Press::Parts {
  Parts(const Compliance& compliance, ContactShape shape, double mu, PressTolerance wanted)
      : gel(compliance),
        friction(mu),
        tolerance(wanted),
        solver(gel, std::move(shape), wanted.lookup_mm, wanted.traction),
        n(static_cast<int>(gel.vertices.size())) {
    mass.compute(gel.mass);
    if (mass.info() != Eigen::Success) fail("the gel's surface mass matrix isn't positive definite");
    now = untouched({}, n);
    state = report(gel, solver.surface(), mass, friction, now);
  }

  const Compliance& gel;
  double friction;
  PressTolerance tolerance;
  PartSolver solver;
  int n;
  SurfaceMassFactor mass;
  PressSnapshot now;
  bool placed = false;
  PressState state;

  double deepest_at(const RigidTransform& pose) const {
    return weighted_gap(solver.surface(), solver.shape(), pose, {}).deepest;
  }
  std::optional<RigidTransform> straight_above(RigidTransform pose) const;
  std::optional<PressSnapshot> before_touch(const PressTarget& target, RigidTransform& to) const;
  std::optional<PressSnapshot> advance(const Path& path, const PressSnapshot& from, double begin, double end,
                                       int halvings, Effort& effort);
  std::optional<PressSnapshot> walk(const Path& path, int halvings, Effort& effort);
  PressSnapshot follow(const PressTarget& target, Effort& effort);
  const PressState& step(const PressTarget& target);
};

/// The pose straight above `pose` in which the body just touches the undeformed gel; nothing if it isn't over it.
std::optional<RigidTransform> Press::Parts::straight_above(RigidTransform pose) const {
  for (int k = 0; k < 30; ++k) {
    const double gap = deepest_at(pose);
    if (!std::isfinite(gap)) return std::nullopt;
    pose.translation.z() -= gap;
    if (std::abs(gap) < 1e-13 * (std::abs(pose.translation.z()) + gel.thickness)) break;
  }
  return pose;
}

/// The part of the path from `begin` to `end` (shares of the whole), halved where it doesn't converge.
std::optional<PressSnapshot> Press::Parts::advance(const Path& path, const PressSnapshot& from, double begin,
                                                   double end, int halvings, Effort& effort) {
  RigidTransform to = between(path.start.pose, path.to, end);
  for (int a = 0; a < 3; ++a) {
    if (path.forced[a]) to.translation[a] = from.pose.translation[a];
  }
  const Eigen::Vector3d force = end >= 1.0 ? path.force : path.start.force + end * (path.force - path.start.force);
  if (auto next = solver.solve(from, {to, path.forced, force}, effort.part)) {
    ++effort.parts;
    return next;
  }
  if (halvings == 0) return std::nullopt;
  const double middle = 0.5 * (begin + end);
  const auto half = advance(path, from, begin, middle, halvings - 1, effort);
  if (!half) return std::nullopt;
  return advance(path, *half, middle, end, halvings - 1, effort);
}

/// Where the path of a step that starts out of contact begins: a pose that just touches. `to` is the step's end with
/// its force-controlled axes as they are before it; z is set to the touch if it's force-controlled. Nothing on a miss.
std::optional<PressSnapshot> Press::Parts::before_touch(const PressTarget& target, RigidTransform& to) const {
  if (target.axis[2].kind == Kind::force) {
    const auto touch = straight_above(to);
    if (!touch) {
      fail("the object isn't over the gel: a force of {:.4g} N can't be reached", target.axis[2].value);
    }
    to = *touch;
    if (target.axis[2].value == 0.0) return std::nullopt;
    return untouched(to, n);
  }
  const double deepest = deepest_at(to);
  if (-deepest > gel.thickness) {
    fail("the object reaches {:.4g} mm into a gel of {:.4g} mm", -deepest, gel.thickness);
  }
  if (!(deepest < 0.0)) return std::nullopt;
  if (!placed || !(deepest_at(now.pose) >= 0.0)) {
    const auto touch = straight_above(to);
    return untouched(touch ? *touch : to, n);
  }
  double clear = 0.0;
  double overlapping = 1.0;
  for (int k = 0; k < 50; ++k) {
    const double middle = 0.5 * (clear + overlapping);
    (deepest_at(between(now.pose, to, middle)) < 0.0 ? overlapping : clear) = middle;
  }
  return untouched(between(now.pose, to, clear), n);
}

PressSnapshot Press::Parts::follow(const PressTarget& target, Effort& effort) {
  Path path;
  path.to = {target.rotation, now.pose.translation};
  path.force.setZero();
  for (int a = 0; a < 3; ++a) {
    path.forced[a] = target.axis[a].kind == Kind::force;
    if (path.forced[a]) {
      path.force[a] = target.axis[a].value;
    } else {
      path.to.translation[a] = target.axis[a].value;
    }
  }
  double shear2 = 0.0;
  for (int a = 0; a < 2; ++a) {
    if (path.forced[a]) shear2 += path.force[a] * path.force[a];
  }
  const double shear = std::sqrt(shear2);
  if (path.forced[2]) {
    const double held = path.force[2] > 0.0 && friction > 0.0 ? friction * path.force[2] : 0.0;
    if (shear > 0.0 && shear >= held * (1.0 - 1e-9)) {
      fail(
          "gross slip: a shear force of {:.6g} N is wanted, but a normal force of {:.6g} N with a friction of {:.4g} "
          "holds less than {:.6g} N",
          shear, path.force[2], friction, held);
    }
  } else if (shear > 0.0 && friction == 0.0) {
    fail("gross slip: a shear force of {:.6g} N is wanted without friction", shear);
  }

  const bool no_force = path.forced[2] && path.force[2] == 0.0;
  if (now.touching && !no_force) {
    path.start = now;
  } else {
    const auto start = before_touch(target, path.to);
    if (!start) {
      if (shear > 0.0)
        fail("gross slip: a shear force of {:.6g} N is wanted, but the object doesn't touch the gel", shear);
      return untouched(path.to, n);
    }
    path.start = *start;
  }
  // A forced axis that nothing can push on stays where it is: without friction, along the surface.
  if (friction == 0.0) {
    for (int a = 0; a < 3; ++a) {
      const bool pushed = std::any_of(solver.surface().normals.begin(), solver.surface().normals.end(),
                                      [&](const Eigen::Vector3d& normal) { return std::abs(normal[a]) > 1e-12; });
      if (!pushed) path.forced[a] = false;
    }
  }

  solver.set_friction(friction);
  const bool bonded = std::isinf(friction);
  auto end = walk(path, friction == 0.0 ? 0 : bonded ? kBondedHalvings : tolerance.most_halvings, effort);
  if (!end && bonded) {
    solver.set_friction(kAsGoodAsInfinite);
    end = walk(path, tolerance.most_halvings, effort);
  }
  if (!end) {
    const double held = friction * std::max(0.0, now.force.z());
    if (shear > 0.0 && !path.forced[2] && shear >= 0.9 * held) {
      fail("gross slip: a shear force of {:.6g} N is wanted, but the friction of {:.4g} holds about {:.6g} N", shear,
           friction, held);
    }
    fail("the press doesn't converge: {}", solver.why_not());
  }
  return *end;
}

/// The path in equal parts no longer than the tolerance allows, each halved where it must be.
std::optional<PressSnapshot> Press::Parts::walk(const Path& path, int halvings, Effort& effort) {
  int parts = 1;
  if (friction > 0.0) {
    Eigen::Vector3d motion = path.to.translation - path.start.pose.translation;
    for (int a = 0; a < 3; ++a) {
      if (path.forced[a]) motion[a] = 0.0;
    }
    parts = std::max(1, static_cast<int>(std::ceil(motion.norm() / tolerance.largest_motion - 1e-9)));
  }
  PressSnapshot at = path.start;
  for (int part = 0; part < parts; ++part) {
    const double begin = static_cast<double>(part) / parts;
    const double end = part + 1 == parts ? 1.0 : static_cast<double>(part + 1) / parts;
    auto next = advance(path, at, begin, end, halvings, effort);
    if (!next) return std::nullopt;
    at = std::move(*next);
  }
  return at;
}

const PressState& Press::Parts::step(const PressTarget& target) {
  check_target(target);
  Effort effort;
  PressSnapshot next = follow(target, effort);
  std::array<bool, 3> forced;
  Eigen::Vector3d wanted = Eigen::Vector3d::Zero();
  for (int a = 0; a < 3; ++a) {
    forced[a] = target.axis[a].kind == Kind::force;
    if (forced[a]) wanted[a] = target.axis[a].value;
    const double allowed = tolerance.force * std::max(1.0, std::abs(wanted[a]));
    if (forced[a] && std::abs(next.force[a] - wanted[a]) > allowed) {
      fail("the press ends at {:.9g} N on axis {} where {:.9g} N are wanted", next.force[a], a, wanted[a]);
    }
  }
  now = std::move(next);
  placed = true;
  state = report(gel, solver.surface(), mass, friction, now);
  for (int a = 0; a < 3; ++a) {
    if (forced[a]) state.force_residual = std::max(state.force_residual, std::abs(now.force[a] - wanted[a]));
  }
  state.candidates = effort.part.candidates;
  state.geometry_updates = effort.part.geometry_updates;
  state.solves = effort.part.solves;
  state.factorisations = effort.part.factorisations;
  state.sweeps = effort.part.sweeps;
  state.parts = effort.parts;
  return state;
}

Press::Press(const Compliance& gel, ContactShape shape, double friction, PressTolerance tolerance) {
  check_shape(shape);
  if (!(friction >= 0.0)) fail("the friction coefficient is {}, it must be at least 0", friction);
  parts_ = std::make_unique<Parts>(gel, std::move(shape), friction, tolerance);
}

Press::Press(Press&&) noexcept = default;
Press& Press::operator=(Press&&) noexcept = default;
Press::~Press() = default;

const PressState& Press::step(const PressTarget& target) {
  return parts_->step(target);
}

const PressState& Press::state() const {
  return parts_->state;
}

}  // namespace touchstone::fem
