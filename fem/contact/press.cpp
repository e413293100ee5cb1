#include "fem/contact/press.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "core/error.h"
#include "fem/contact/press_part.h"
#include "fem/contact/press_report.h"
#include "fem/contact/press_target.h"
#include "fem/contact/tip_gap.h"

namespace touchstone::fem {
namespace {

constexpr double kAsGoodAsInfinite = 100.0;  // for an infinite friction whose sets cycle
constexpr int kBondedHalvings = 1;
constexpr int kMostParts = 100000;    // of a step: more take minutes
constexpr double kNearerTouch = 0.5;  // of the gap before: what comes nearer by less is as near as it can be
constexpr double kNoOverlap = 1e-9;   // of the thickness: an overlap of rounding is none

using Kind = AxisControl::Kind;

/// A straight path: positions and rotations from `start` to `to`, forces and torques from those at `start` to those of
/// `to`.
struct Path {
  PressSnapshot start;
  std::vector<PartTarget> to;
  double seconds = 0.0;
  bool first_touch = false;  ///< by force, with friction
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

struct Press::Parts {
  Parts(const Compliance& compliance, std::vector<PressBody> bodies, PressTolerance wanted, PronySeries relaxation,
        PressOutput what)
      : gel(compliance),
        tolerance(wanted),
        output(what),
        solver(gel, std::move(bodies), wanted.lookup_mm, wanted.traction, wanted.outlines, std::move(relaxation)),
        n(static_cast<int>(gel.vertices.size())),
        placed(solver.bodies().size(), 0) {
    if (output == PressOutput::fields) {
      mass.compute(gel.mass);
      if (mass.info() != Eigen::Success) fail("the gel's surface mass matrix isn't positive definite");
    }
    now = untouched(std::vector<BodySnapshot>(solver.bodies().size()), n);
    state = report(gel, solver, mass, output, now);
  }

  const Compliance& gel;
  PressTolerance tolerance;
  PressOutput output;
  PartSolver solver;
  int n;
  SurfaceMassFactor mass;
  PressSnapshot now;
  std::vector<char> placed;  ///< per body
  PressState state;

  double friction(std::size_t body) const { return solver.bodies()[body].friction; }
  double deepest_at(std::size_t body, const RigidTransform& pose) const {
    return deepest_gap(solver.surface(), solver.bodies()[body].shape, pose, tolerance.outlines);
  }
  std::optional<RigidTransform> straight_above(std::size_t body, RigidTransform pose) const;
  std::optional<RigidTransform> before_touch(std::size_t body, const PressTarget& target, RigidTransform& to,
                                             double& clear) const;
  double add_segment(std::size_t body, const PressTarget& target, Path& path) const;
  std::optional<PressSnapshot> advance(const Path& path, const PressSnapshot& from, double begin, double end,
                                       int halvings, Effort& effort);
  std::optional<PressSnapshot> walk(const Path& path, int halvings, Effort& effort);
  PressSnapshot follow(std::span<const PressTarget> targets, Effort& effort);
  const PressState& step(std::span<const PressTarget> targets);
};

/// The pose straight above `pose` in which the body just touches the undeformed gel; nothing if it isn't over it.
std::optional<RigidTransform> Press::Parts::straight_above(std::size_t body, RigidTransform pose) const {
  double before = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 30; ++k) {
    const double gap = deepest_at(body, pose);
    if (!std::isfinite(gap)) return std::nullopt;
    // An overlap is looked at more closely than a gap, on curved gels at other points: there both go to and fro for
    // ever.
    const bool nearer = std::abs(gap) < kNearerTouch * before;
    if (nearer || gap < 0.0) pose.translation.z() -= gap;
    if (!nearer || std::abs(gap) < 1e-13 * (std::abs(pose.translation.z()) + gel.thickness)) break;
    before = std::abs(gap);
  }
  return pose;
}

/// The part of the path from `begin` to `end` (shares of the whole), halved where it doesn't converge.
std::optional<PressSnapshot> Press::Parts::advance(const Path& path, const PressSnapshot& from, double begin,
                                                   double end, int halvings, Effort& effort) {
  const std::vector<PartTarget> targets = targets_along(path.start.bodies, path.to, from.bodies, begin, end);
  if (auto next = solver.solve(from, targets, (end - begin) * path.seconds, effort.part)) {
    ++effort.parts;
    return next;
  }
  if (halvings == 0) return std::nullopt;
  const double middle = 0.5 * (begin + end);
  const auto half = advance(path, from, begin, middle, halvings - 1, effort);
  if (!half) return std::nullopt;
  return advance(path, *half, middle, end, halvings - 1, effort);
}

/// Where the path of a body that starts out of contact begins: a pose that just touches. `to` is the step's end with
/// its force-controlled axes as they are before it; z is set to the touch if it's force-controlled. `clear` is set to
/// the share of the step that goes before. Nothing on a miss.
std::optional<RigidTransform> Press::Parts::before_touch(std::size_t body, const PressTarget& target,
                                                         RigidTransform& to, double& clear) const {
  clear = 0.0;
  if (target.axis[2].kind == Kind::force) {
    const auto touch = straight_above(body, to);
    if (!touch) {
      fail("the object isn't over the gel: a force of {:.4g} N can't be reached", target.axis[2].value);
    }
    to = *touch;
    if (target.axis[2].value == 0.0) return std::nullopt;
    return to;
  }
  const double deepest = deepest_at(body, to);
  if (-deepest > gel.thickness) {
    fail("the object reaches {:.4g} mm into a gel of {:.4g} mm", -deepest, gel.thickness);
  }
  if (!(deepest < 0.0)) {
    if (now.history.empty()) return std::nullopt;
    return to;  // what still bulges beside an old dent may be touched
  }
  const RigidTransform& here = now.bodies[body].pose;
  if (!placed[body] || !(deepest_at(body, here) >= 0.0)) return straight_above(body, to).value_or(to);
  clear = share_before_overlap(here, to, [&](const RigidTransform& pose) { return deepest_at(body, pose) < 0.0; });
  return between(here, to, clear);
}

/// Sets one body's start and end. The share of the step after which it may touch.
double Press::Parts::add_segment(std::size_t b, const PressTarget& target, Path& path) const {
  double clear = 0.0;
  const BodySnapshot& here = now.bodies[b];
  BodySnapshot& start = path.start.bodies[b];
  PartTarget to = part_target(target, here, start.turn);
  refuse_what_slips(to, solver.bodies()[b], solver.surface().flat);
  const bool no_force = to.forced[2] && to.force[2] == 0.0;
  bool meets = here.touching && !no_force;
  if (!meets) {
    const auto touch = before_touch(b, target, to.pose, clear);
    meets = touch.has_value();
    if (!meets) refuse_shear_of_nothing(to);
    start.pose = touch.value_or(to.pose);
    if (!touch) clear = 1.0;
    path.first_touch = path.first_touch || (meets && friction(b) > 0.0 && to.forced[2]);
  }
  if (!here.touching || no_force) path.start.forget(static_cast<int>(b));
  if (!meets)
    to.forced = to.turned = {};  // nothing to push against: it goes to the given position and turns no further
  leave_free_axes(solver.surface(), friction(b), to);
  path.to.push_back(to);
  return clear;
}

PressSnapshot Press::Parts::follow(std::span<const PressTarget> targets, Effort& effort) {
  Path path;
  path.start = now;
  path.seconds = targets.front().seconds;
  double clear = 1.0;
  for (std::size_t b = 0; b < targets.size(); ++b) clear = std::min(clear, add_segment(b, targets[b], path));
  if (solver.relaxes() && clear > 0.0 && clear < 1.0) {  // nothing touches yet: the gel recovers on the path
    path.start = solver.apart(now, path.start.bodies, clear * path.seconds);
    path.seconds *= 1.0 - clear;
  }
  std::vector<double> mu;
  bool bonded = false;
  bool any_friction = false;
  for (std::size_t b = 0; b < targets.size(); ++b) {
    mu.push_back(friction(b));
    bonded = bonded || std::isinf(mu.back());
    any_friction = any_friction || mu.back() > 0.0;
  }
  solver.set_friction(mu);
  auto end = walk(path, !any_friction ? 0 : bonded ? kBondedHalvings : tolerance.most_halvings, effort);
  if (!end && bonded) {
    for (double& value : mu) value = std::min(value, kAsGoodAsInfinite);
    solver.set_friction(mu);
    end = walk(path, tolerance.most_halvings, effort);
  }
  if (!end) {
    for (std::size_t b = 0; b < targets.size(); ++b) {
      const PartTarget& to = path.to[b];
      const double shear = wanted_shear(to);
      const double held = friction(b) * std::max(0.0, now.bodies[b].force.z());
      if (shear > 0.0 && !to.forced[2] && shear >= 0.9 * held) {
        fail("gross slip: a shear force of {:.6g} N is wanted, but the friction of {:.4g} holds about {:.6g} N", shear,
             friction(b), held);
      }
    }
    fail("the press doesn't converge: {}", solver.why_not());
  }
  return *end;
}

/// The path in equal parts no longer than the tolerance allows, or in those of a first touch, each halved where it must
/// be.
std::optional<PressSnapshot> Press::Parts::walk(const Path& path, int halvings, Effort& effort) {
  int parts = 1;
  for (std::size_t b = 0; b < path.to.size(); ++b) {
    if (friction(b) == 0.0) continue;
    Eigen::Vector3d motion = path.to[b].pose.translation - path.start.bodies[b].pose.translation;
    for (int a = 0; a < 3; ++a) {
      if (path.to[b].forced[a]) motion[a] = 0.0;
    }
    const double wanted = std::ceil(motion.norm() / tolerance.largest_motion - 1e-9);
    if (wanted > kMostParts) {
      fail(
          "the object goes {:.4g} mm in a step, in parts of {:.4g} mm: allowed are {} parts a step; take shorter steps",
          motion.norm(), tolerance.largest_motion, kMostParts);
    }
    parts = std::max(parts, static_cast<int>(wanted));
  }
  const bool doubling = path.first_touch && parts < tolerance.touch_parts;
  if (doubling) parts = tolerance.touch_parts;
  PressSnapshot at = path.start;
  double begin = 0.0;
  for (int part = 1; part <= parts; ++part) {
    const double end = part == parts ? 1.0
                       : doubling    ? std::ldexp(1.0, part - parts)
                                     : static_cast<double>(part) / parts;
    auto next = advance(path, at, begin, end, halvings, effort);
    if (!next) return std::nullopt;
    at = std::move(*next);
    begin = end;
  }
  return at;
}

const PressState& Press::Parts::step(std::span<const PressTarget> targets) {
  if (targets.size() != solver.bodies().size()) {
    fail("{} targets are given for {} bodies", targets.size(), solver.bodies().size());
  }
  for (const PressTarget& target : targets) check_target(target);
  Effort effort;
  PressSnapshot next = follow(targets, effort);
  double force_residual = 0.0;
  double torque_residual = 0.0;
  for (std::size_t b = 0; b < targets.size(); ++b) {
    const BodySnapshot& body = next.bodies[b];
    for (int a = 0; a < 3; ++a) {
      if (targets[b].axis[a].kind == Kind::force) {
        const double wanted = targets[b].axis[a].value;
        const double missing = std::abs(body.force[a] - wanted);
        force_residual = std::max(force_residual, missing);
        if (missing > tolerance.force * std::max(1.0, std::abs(wanted))) {
          fail("the press ends at {:.9g} N on axis {} where {:.9g} N are wanted", body.force[a], a, wanted);
        }
      }
      if (targets[b].torque[a] && body.touching) {
        torque_residual = std::max(torque_residual, std::abs(torque_on(body)[a] - *targets[b].torque[a]));
      }
    }
  }
  for (std::size_t b = 0; b < targets.size(); ++b) {
    BodySnapshot& body = next.bodies[b];
    if (body.touching || body.overlapping || solver.relaxes()) continue;
    // A tip that stands between all lines gives no force, but that is no miss.
    body.overlapping = tip_gap(solver.surface(), solver.bodies()[b].shape, body.pose) < -kNoOverlap * gel.thickness;
  }
  now = std::move(next);
  placed.assign(placed.size(), 1);
  state = report(gel, solver, mass, output, now);
  state.force_residual = force_residual;
  state.torque_residual = torque_residual;
  state.candidates = effort.part.candidates;
  state.geometry_updates = effort.part.geometry_updates;
  state.solves = effort.part.solves;
  state.factorisations = effort.part.factorisations;
  state.sweeps = effort.part.sweeps;
  state.parts = effort.parts;
  return state;
}

Press::Press(const Compliance& gel, std::vector<PressBody> bodies, PressTolerance tolerance, PronySeries relaxation,
             PressOutput output) {
  TS_ASSERT(!bodies.empty());
  check(relaxation);
  for (const PressBody& body : bodies) {
    check_shape(body.shape);
    if (!(body.friction >= 0.0)) fail("the friction coefficient is {}, it must be at least 0", body.friction);
  }
  parts_ = std::make_unique<Parts>(gel, std::move(bodies), tolerance, std::move(relaxation), output);
}

Press::Press(const Compliance& gel, ContactShape shape, double friction, PressTolerance tolerance,
             PronySeries relaxation, PressOutput output)
    : Press(gel, std::vector<PressBody>{{std::move(shape), friction, nullptr}}, tolerance, std::move(relaxation),
            output) {}

Press::Press(Press&&) noexcept = default;
Press& Press::operator=(Press&&) noexcept = default;
Press::~Press() = default;

const PressState& Press::step(std::span<const PressTarget> targets) {
  return parts_->step(targets);
}

const PressState& Press::state() const {
  return parts_->state;
}

}  // namespace touchstone::fem
