#include "fem/finite_strain/finite_press.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "core/error.h"
#include "fem/contact/press_report.h"
#include "fem/elements/surface_strain.h"
#include "fem/finite_strain/finite_part.h"
#include "fem/finite_strain/force_growth.h"

namespace touchstone::fem {
namespace {

constexpr double kLargestPart = 0.1;    // of the thickness: the motion in one part
constexpr double kFirstTouch = 0.02;    // of the thickness: where a force-controlled press begins
constexpr double kDeepestTouch = 0.16;  // at most, where nothing touches before

struct Effort {
  PartEffort part;
  int parts = 0;
  double clear = 0.0;  // share of the step before the touch
};

}  // namespace

struct FinitePress::Parts {
  Parts(const FiniteGel& on, PressBody body, PressTolerance wanted, PronySeries relaxing)
      : gel(on),
        friction(body.friction),
        tolerance(wanted),
        series(std::move(relaxing)),
        solver(on, std::move(body), wanted),
        n(static_cast<int>(gel.rest.vertices.size())) {
    mass.compute(gel.mass);
    if (mass.info() != Eigen::Success) fail("the gel's surface mass matrix isn't positive definite");
    now = untouched(gel, {});
    state = report(now);
  }

  const FiniteGel& gel;
  double friction;
  PressTolerance tolerance;
  PronySeries series;
  FinitePartSolver solver;
  int n;
  SurfaceMassFactor mass;
  FiniteSnapshot now;
  RelaxationHistory history;  ///< of the tractions' rows and the wrench; empty if the gel doesn't relax
  bool placed = false;
  PressState state;

  double overlap(const RigidTransform& pose) const { return solver.overlap(pose); }
  void refuse_too_deep(const RigidTransform& pose) const;
  void refuse_path_through(const RigidTransform& pose) const;
  std::optional<FiniteSnapshot> advance(const FiniteSnapshot& start, const PartTarget& target,
                                        const FiniteSnapshot& from, double begin, double end, int halvings,
                                        Effort& effort);
  [[noreturn]] void fail_to_converge(const Effort& effort) const;
  std::optional<RigidTransform> straight_above(RigidTransform pose) const;
  FiniteSnapshot follow(const PressTarget& target, Effort& effort);
  PressState report(const FiniteSnapshot& at) const;
  Eigen::Vector3d elastic_force(const PressTarget& target, const PartTarget& to) const;
  void relax(double seconds, double clear, PressState& elastic);
};

void FinitePress::Parts::refuse_too_deep(const RigidTransform& pose) const {
  const double depth = overlap(pose);
  if (depth > gel.thickness) fail("the object reaches {:.4g} mm into a gel of {:.4g} mm", depth, gel.thickness);
}

/// A body that has gone through a curved gel is beside it again: that doesn't make the path allowed.
void FinitePress::Parts::refuse_path_through(const RigidTransform& pose) const {
  if (!placed || !(pose.translation.z() < now.pose.translation.z())) return;
  const double distance = (pose.translation - now.pose.translation).norm();
  const int parts = static_cast<int>(std::min(1000.0, std::ceil(4.0 * distance / gel.thickness)));
  for (int k = 1; k < parts; ++k) {
    const double depth = overlap(between(now.pose, pose, static_cast<double>(k) / parts));
    if (depth > 0.45 * gel.thickness) {
      fail("the object goes through the gel: it reaches {:.4g} mm into {:.4g} mm on its path", depth, gel.thickness);
    }
  }
}

/// From the share `begin` of the path from `start` to the target to the share `end`, halved where it doesn't converge.
std::optional<FiniteSnapshot> FinitePress::Parts::advance(const FiniteSnapshot& start, const PartTarget& target,
                                                          const FiniteSnapshot& from, double begin, double end,
                                                          int halvings, Effort& effort) {
  PartTarget part = target;
  part.pose = between(start.pose, target.pose, end);
  if (end < 1.0) part.force = start.force + end * (target.force - start.force);
  for (int a = 0; a < 3; ++a) {
    if (target.forced[a]) part.pose.translation[a] = from.pose.translation[a];
  }
  if (auto next = solver.solve(from, part, effort.part)) {
    ++effort.parts;
    return next;
  }
  if (halvings == 0 || effort.part.factorisations >= tolerance.most_factorisations) return std::nullopt;
  const double middle = 0.5 * (begin + end);
  const auto half = advance(start, target, from, begin, middle, halvings - 1, effort);
  if (!half) return std::nullopt;
  return advance(start, target, *half, middle, end, halvings - 1, effort);
}

void FinitePress::Parts::fail_to_converge(const Effort& effort) const {
  fail("the press doesn't converge: {} (after {} factorisations; it gives up at {})", solver.why_not(),
       effort.part.factorisations, tolerance.most_factorisations);
}

/// The pose straight above `pose` in which the body just touches the undeformed gel; nothing if it isn't over it.
std::optional<RigidTransform> FinitePress::Parts::straight_above(RigidTransform pose) const {
  for (int k = 0; k < 30; ++k) {
    const double depth = overlap(pose);
    if (!std::isfinite(depth)) return std::nullopt;
    pose.translation.z() += depth;
    if (std::abs(depth) < 1e-12 * (std::abs(pose.translation.z()) + gel.thickness)) break;
  }
  return pose;
}

FiniteSnapshot FinitePress::Parts::follow(const PressTarget& target, Effort& effort) {
  if (target.torque[0] || target.torque[1] || target.torque[2]) {
    fail("a press at finite strain can't be led by torques, only by forces and poses");
  }
  PartTarget to;
  to.pose = {target.rotation, now.pose.translation};
  for (int a = 0; a < 3; ++a) {
    to.forced[a] = target.axis[a].kind == AxisControl::Kind::force;
    (to.forced[a] ? to.force[a] : to.pose.translation[a]) = target.axis[a].value;
  }
  if (!series.empty()) to.force = elastic_force(target, to);
  double shear = 0.0;
  for (int a = 0; a < 2; ++a) {
    if (to.forced[a]) shear = std::hypot(shear, to.force[a]);
  }
  if (shear > 0.0 && friction == 0.0) {
    fail("gross slip: a shear force of {:.6g} N is wanted without friction", shear);
  }
  const double held = to.force[2] > 0.0 && friction > 0.0 ? friction * to.force[2] : 0.0;
  if (shear > 0.0 && to.forced[2] && shear >= held * (1.0 - 1e-9)) {
    fail(
        "gross slip: a shear force of {:.6g} N is wanted, but a normal force of {:.6g} N with a friction of {:.4g} "
        "holds less than {:.6g} N",
        shear, to.force[2], friction, held);
  }
  // A forced axis that nothing can push on stays where it is: without friction, along the surface.
  for (int a = 0; a < 2 && friction == 0.0; ++a) to.forced[a] = false;

  if (!to.forced[2] && !(overlap(to.pose) > 0.0)) {
    refuse_path_through(to.pose);
    if (shear > 0.0) {
      fail("gross slip: a shear force of {:.6g} N is wanted, but the object doesn't touch the gel", shear);
    }
    return untouched(gel, to.pose);
  }
  FiniteSnapshot start = now;
  const bool no_force = to.forced[2] && to.force[2] == 0.0;
  if (!now.touching || no_force) {
    std::optional<RigidTransform> touch = straight_above(to.pose);
    if (to.forced[2]) {
      if (!touch) fail("the object isn't over the gel: a force of {:.4g} N can't be reached", to.force[2]);
      if (no_force) return untouched(gel, *touch);
      to.pose = *touch;
    } else {
      refuse_too_deep(to.pose);
      if (placed && !(overlap(now.pose) > 0.0)) {
        double clear = 0.0;
        double overlapping = 1.0;
        for (int k = 0; k < 50; ++k) {
          const double middle = 0.5 * (clear + overlapping);
          (overlap(between(now.pose, to.pose, middle)) > 0.0 ? overlapping : clear) = middle;
        }
        touch = between(now.pose, to.pose, clear);
        effort.clear = clear;
      }
    }
    start = untouched(gel, touch ? *touch : to.pose);
  }
  if (!to.forced[2]) refuse_too_deep(to.pose);
  if (to.forced[2] && !start.touching) {
    // A little by position first: a force has nothing to act on yet. A body smaller than an edge may have to go deeper
    // until a vertex meets it.
    for (double depth = kFirstTouch; !start.touching; depth *= 2.0) {
      if (depth > kDeepestTouch) {
        fail("the press doesn't converge: no vertex touches within {:.3g} mm", kDeepestTouch * gel.thickness);
      }
      PartTarget first;
      first.pose = to.pose;
      first.pose.translation.z() -= depth * gel.thickness;
      auto begun = advance(start, first, start, 0.0, 1.0, tolerance.most_halvings, effort);
      if (!begun) fail_to_converge(effort);
      start = std::move(*begun);
    }
  }

  double parts = 1.0;
  Eigen::Vector3d motion = to.pose.translation - start.pose.translation;
  for (int a = 0; a < 3; ++a) {
    if (to.forced[a]) motion[a] = 0.0;
  }
  parts = std::max(parts, std::ceil(motion.norm() / std::min(kLargestPart * gel.thickness, tolerance.largest_motion)));
  FiniteSnapshot at = start;
  if (to.forced[2]) {
    ForceGrowth growth(to.force.z());
    while (const std::optional<double> force = growth.next(at.force.z())) {
      PartTarget part = to;
      part.force = to.force * (*force / to.force.z());
      part.pose = between(start.pose, to.pose, 1.0);
      auto next = advance(at, part, at, 0.0, 1.0, tolerance.most_halvings, effort);
      if (!next) fail_to_converge(effort);
      at = std::move(*next);
    }
    start = at;
  }
  for (int part = 0; part < static_cast<int>(parts); ++part) {
    const double end = part + 1 >= parts ? 1.0 : (part + 1) / parts;
    auto next = advance(start, to, at, part / parts, end, tolerance.most_halvings, effort);
    if (!next) fail_to_converge(effort);
    at = std::move(*next);
  }
  return at;
}

PressState FinitePress::Parts::report(const FiniteSnapshot& at) const {
  PressState s;
  s.gel_from_object = at.pose;
  s.node_state = at.state;
  s.traction = Eigen::MatrixX3d::Zero(n, 3);
  s.surface_displacement = Eigen::MatrixX3d::Zero(n, 3);
  s.bead_displacement = gel.bead_weight * at.elastic.displacement;
  s.largest_penetration = at.penetration;
  s.contact_residual = at.residual;
  if (at.touching) {
    s.surface_displacement = mass.solve(gel.coupling * at.elastic.displacement);
    const Eigen::MatrixX3d nodal = traction_forces(gel, at) + bulge_forces(gel, at);
    s.wrench.head<3>() = at.force;
    for (int node = 0; node < gel.space.nodes; ++node) {
      const Eigen::Vector3d place = gel.space.position(node) + at.elastic.displacement.row(node).transpose();
      s.wrench.tail<3>() -= place.cross(Eigen::Vector3d(nodal.row(node)));
    }
    double excess = 0.0;
    for (int v = 0; v < n; ++v) {
      if (at.state[v] == NodeState::open) continue;
      s.traction.row(v) = traction_at(gel, at, v).transpose();
      s.largest_tension = std::max(s.largest_tension, -at.pressure[v]);
      if (std::isfinite(friction)) {
        excess = std::max(excess, at.shear.row(v).norm() - friction * std::max(0.0, at.pressure[v]));
      }
      s.contact_area += gel.rest.weight[v];
      ++s.contact_vertices;
    }
    const double largest = at.pressure.maxCoeff();
    if (friction > 0.0 && largest > 0.0) s.cone_violation = excess / (friction * largest);
    s.largest_gradient = largest_surface_gradient(gel.rest.vertices, gel.rest.triangles, s.surface_displacement);
    double deepest = 0.0;
    for (int v = 0; v < n; ++v) {
      deepest = std::max(deepest, std::abs(gel.rest.normals[v].dot(s.surface_displacement.row(v))));
    }
    s.largest_strain = std::max(s.largest_gradient, deepest / gel.thickness);
  }
  s.node_owner.assign(n, -1);
  for (int v = 0; v < n; ++v) {
    if (at.state[v] != NodeState::open) s.node_owner[v] = 0;
  }
  s.bodies = {{s.gel_from_object, s.wrench, s.contact_area, s.contact_vertices}};
  const auto overlaps = [&] { return overlap(at.pose) > 0.0 || solver.tip_overlap(at.pose) > 0.0; };
  s.under_resolved = (at.touching || overlaps()) && !is_resolved(gel.rest, s.node_owner, 0);
  return s;
}

/// The forces on the elastic gel that the wanted ones take, with what the gel remembers.
Eigen::Vector3d FinitePress::Parts::elastic_force(const PressTarget& target, const PartTarget& to) const {
  const RelaxationStep step = relaxation_step(series, target.seconds);
  const Eigen::VectorXd rest = carried_over(step, history, 3 * n + 6);
  Eigen::Vector3d force = to.force;
  for (int a = 0; a < 3; ++a) {
    // None is none: a gel that isn't pushed comes back with nothing on it.
    if (to.forced[a] && to.force[a] != 0.0) force[a] = (to.force[a] - rest[3 * n + a]) / step.stiffness;
  }
  return force;
}

/// From the elastic gel's tractions and wrench to those of the gel that relaxes.
void FinitePress::Parts::relax(double seconds, double clear, PressState& elastic) {
  Eigen::VectorXd now_elastic(3 * n + 6);
  for (int v = 0; v < n; ++v) now_elastic.segment<3>(3 * v) = elastic.traction.row(v).transpose();
  now_elastic.tail<6>() = elastic.wrench;
  if (clear > 0.0) {  // nothing touches yet: what was there recovers
    const RelaxationStep before = relaxation_step(series, clear * seconds);
    history = after_step(before, history, carried_over(before, history, now_elastic.size()));
  }
  const RelaxationStep step = relaxation_step(series, (1.0 - clear) * seconds);
  const Eigen::VectorXd relaxed = step.stiffness * now_elastic + carried_over(step, history, now_elastic.size());
  history = after_step(step, history, relaxed);
  elastic.largest_tension = 0.0;
  const bool pulls = !(relaxed[3 * n + 2] > 0.0);
  elastic.traction.setZero();
  for (int v = 0; v < n && !pulls; ++v) {
    if (elastic.node_state[v] == NodeState::open) continue;
    elastic.traction.row(v) = relaxed.segment<3>(3 * v).transpose();
    const double pressure = elastic.traction.row(v).dot(now.gap.direction.row(v).normalized());
    elastic.largest_tension = std::max(elastic.largest_tension, -pressure);
  }
  elastic.wrench.setZero();
  if (!pulls) elastic.wrench = relaxed.tail<6>();
  elastic.bodies.front().wrench = elastic.wrench;
}

FinitePress::FinitePress(const FiniteGel& gel, PressBody body, PressTolerance tolerance, PronySeries relaxation) {
  check_shape(body.shape);
  check(relaxation);
  if (!(body.friction >= 0.0)) fail("the friction coefficient is {}, it must be at least 0", body.friction);
  if (body.elastic && !relaxation.empty()) {
    fail("an elastic object can't be pressed at finite strain on a gel that relaxes");
  }
  parts_ = std::make_unique<Parts>(gel, std::move(body), tolerance, std::move(relaxation));
}

FinitePress::FinitePress(const FiniteGel& gel, ContactShape shape, double friction, PressTolerance tolerance,
                         PronySeries relaxation)
    : FinitePress(gel, PressBody{std::move(shape), friction, nullptr}, tolerance, std::move(relaxation)) {}

FinitePress::FinitePress(FinitePress&&) noexcept = default;
FinitePress& FinitePress::operator=(FinitePress&&) noexcept = default;
FinitePress::~FinitePress() = default;

const PressState& FinitePress::step(const PressTarget& target) {
  check_target(target);
  Parts& p = *parts_;
  Effort effort;
  const std::shared_ptr<const FiniteTangent> before = p.solver.tangent();
  FiniteSnapshot next;
  try {
    next = p.follow(target, effort);
  } catch (...) {
    p.solver.take_back(before);
    throw;
  }
  p.now = std::move(next);
  p.placed = true;
  p.state = p.report(p.now);
  if (!p.series.empty()) p.relax(target.seconds, effort.clear, p.state);
  for (int a = 0; a < 3; ++a) {
    if (target.axis[a].kind == AxisControl::Kind::force) {
      const double force = p.series.empty() ? p.now.force[a] : p.state.wrench[a];
      p.state.force_residual = std::max(p.state.force_residual, std::abs(force - target.axis[a].value));
    }
  }
  p.state.candidates = effort.part.candidates;
  p.state.geometry_updates = effort.part.geometry_updates;
  p.state.solves = effort.part.solves;
  p.state.factorisations = effort.part.factorisations;
  p.state.sweeps = effort.part.sweeps;
  p.state.parts = effort.parts;
  return p.state;
}

const PressState& FinitePress::state() const {
  return parts_->state;
}

std::optional<RigidTransform> FinitePress::touching(const RigidTransform& pose) const {
  return parts_->straight_above(pose);
}

const ElasticSolution& FinitePress::solution() const {
  return parts_->now.elastic;
}

double FinitePress::stored_energy() const {
  const FiniteSnapshot& now = parts_->now;
  double energy = parts_->gel.problem.stored_energy(now.elastic);
  for (int v = 0; v < static_cast<int>(now.given.rows()); ++v) {
    energy += 0.5 * traction_at(parts_->gel, now, v).dot(now.given.row(v));
  }
  return energy;
}

}  // namespace touchstone::fem
