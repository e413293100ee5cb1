#include "fem/finite_strain/finite_press.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/error.h"
#include "fem/contact/press_report.h"
#include "fem/contact/press_target.h"
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

/// A straight path to the targets.
struct Path {
  FiniteSnapshot start;
  std::vector<PartTarget> to;
  bool meets = false;  // does any body touch at its end?
};

}  // namespace

struct FinitePress::Parts {
  Parts(const FiniteGel& on, std::vector<PressBody> bodies, PressTolerance wanted, PronySeries relaxing)
      : gel(on),
        tolerance(wanted),
        series(std::move(relaxing)),
        solver(on, std::move(bodies), wanted),
        n(static_cast<int>(gel.rest.vertices.size())),
        count(static_cast<int>(solver.bodies().size())) {
    mass.compute(gel.mass);
    if (mass.info() != Eigen::Success) fail("the gel's surface mass matrix isn't positive definite");
    now = untouched(gel, std::vector<BodySnapshot>(static_cast<std::size_t>(count)));
    state = report(now);
  }

  const FiniteGel& gel;
  PressTolerance tolerance;
  PronySeries series;
  FinitePartSolver solver;
  int n;      // vertices
  int count;  // bodies
  SurfaceMassFactor mass;
  FiniteSnapshot now;
  RelaxationHistory history;  ///< of the tractions' rows and the wrenches; empty if the gel doesn't relax
  bool placed = false;
  PressState state;

  double friction(int body) const { return solver.bodies()[body].friction; }
  void refuse_too_deep(int body, const RigidTransform& pose) const;
  void refuse_path_through(int body, const RigidTransform& pose) const;
  std::optional<FiniteSnapshot> advance(const FiniteSnapshot& start, const std::vector<PartTarget>& to,
                                        const FiniteSnapshot& from, double begin, double end, int halvings,
                                        Effort& effort);
  FiniteSnapshot advanced(const FiniteSnapshot& start, const std::vector<PartTarget>& to, const FiniteSnapshot& from,
                          double begin, double end, Effort& effort);
  std::optional<RigidTransform> straight_above(int body, RigidTransform pose) const;
  double add_segment(int body, const PressTarget& target, Path& path) const;
  FiniteSnapshot touched_by_force(const Path& path, Effort& effort);
  FiniteSnapshot grown_forces(const Path& path, FiniteSnapshot at, Effort& effort);
  FiniteSnapshot follow(std::span<const PressTarget> targets, Effort& effort);
  PressState report(const FiniteSnapshot& at) const;
  Eigen::Vector3d elastic_force(int body, const PressTarget& target, const PartTarget& to) const;
  void relax(double seconds, double clear, PressState& elastic);
};

void FinitePress::Parts::refuse_too_deep(int body, const RigidTransform& pose) const {
  const double depth = solver.overlap(body, pose);
  if (depth > gel.thickness) fail("the object reaches {:.4g} mm into a gel of {:.4g} mm", depth, gel.thickness);
}

/// A body that has gone through a curved gel is beside it again: that doesn't make the path allowed.
void FinitePress::Parts::refuse_path_through(int body, const RigidTransform& pose) const {
  const RigidTransform& here = now.bodies[body].pose;
  if (!placed || !(pose.translation.z() < here.translation.z())) return;
  const double distance = (pose.translation - here.translation).norm();
  const int parts = static_cast<int>(std::min(1000.0, std::ceil(4.0 * distance / gel.thickness)));
  for (int k = 1; k < parts; ++k) {
    const double depth = solver.overlap(body, between(here, pose, static_cast<double>(k) / parts));
    if (depth > 0.45 * gel.thickness) {
      fail("the object goes through the gel: it reaches {:.4g} mm into {:.4g} mm on its path", depth, gel.thickness);
    }
  }
}

/// From the share `begin` of the path from `start` to the targets to the share `end`, halved where it doesn't converge.
std::optional<FiniteSnapshot> FinitePress::Parts::advance(const FiniteSnapshot& start,
                                                          const std::vector<PartTarget>& to, const FiniteSnapshot& from,
                                                          double begin, double end, int halvings, Effort& effort) {
  const std::vector<PartTarget> parts = targets_along(start.bodies, to, from.bodies, begin, end);
  if (auto next = solver.solve(from, parts, effort.part)) {
    ++effort.parts;
    return next;
  }
  if (halvings == 0 || effort.part.factorisations >= tolerance.most_factorisations) return std::nullopt;
  const double middle = 0.5 * (begin + end);
  const auto half = advance(start, to, from, begin, middle, halvings - 1, effort);
  if (!half) return std::nullopt;
  return advance(start, to, *half, middle, end, halvings - 1, effort);
}

/// The same. @throws Error if it doesn't converge
FiniteSnapshot FinitePress::Parts::advanced(const FiniteSnapshot& start, const std::vector<PartTarget>& to,
                                            const FiniteSnapshot& from, double begin, double end, Effort& effort) {
  auto next = advance(start, to, from, begin, end, tolerance.most_halvings, effort);
  if (!next) {
    fail("the press doesn't converge: {} (after {} factorisations; it gives up at {})", solver.why_not(),
         effort.part.factorisations, tolerance.most_factorisations);
  }
  return std::move(*next);
}

/// The pose straight above `pose` in which the body just touches the undeformed gel; nothing if it isn't over it.
std::optional<RigidTransform> FinitePress::Parts::straight_above(int body, RigidTransform pose) const {
  for (int k = 0; k < 30; ++k) {
    const double depth = solver.overlap(body, pose);
    if (!std::isfinite(depth)) return std::nullopt;
    pose.translation.z() += depth;
    if (std::abs(depth) < 1e-12 * (std::abs(pose.translation.z()) + gel.thickness)) break;
  }
  return pose;
}

/// Sets one body's start and end. The share of the step after which it may touch. A body that lifts off goes along its
/// path like any other.
double FinitePress::Parts::add_segment(int b, const PressTarget& target, Path& path) const {
  const BodySnapshot& here = now.bodies[b];
  BodySnapshot& start = path.start.bodies[b];
  PartTarget to = part_target(target, here, start.turn);
  if (!series.empty()) {
    if (to.turned[0] || to.turned[1] || to.turned[2]) {
      fail("a press at finite strain on a gel that relaxes can't be led by torques, only by forces and poses");
    }
    to.force = elastic_force(b, target, to);
  }
  refuse_what_slips(to, solver.bodies()[b], gel.rest.flat);
  leave_free_axes(gel.rest, friction(b), to);
  double clear = here.touching ? 0.0 : 1.0;
  bool meets = true;
  if (to.forced[2]) {
    meets = to.force[2] > 0.0;
    if (!here.touching || !meets) {
      const std::optional<RigidTransform> touch = straight_above(b, to.pose);
      if (!touch) fail("the object isn't over the gel: a force of {:.4g} N can't be reached", to.force[2]);
      to.pose = *touch;
      if (meets) clear = 0.0;
      if (!here.touching) start.pose = *touch;
    }
  } else if (solver.overlap(b, to.pose) > 0.0) {
    refuse_too_deep(b, to.pose);
    if (!here.touching) {
      clear = 0.0;
      start.pose = straight_above(b, to.pose).value_or(to.pose);
      if (placed && !(solver.overlap(b, here.pose) > 0.0)) {
        clear = share_before_overlap(here.pose, to.pose,
                                     [&](const RigidTransform& pose) { return solver.overlap(b, pose) > 0.0; });
        start.pose = between(here.pose, to.pose, clear);
      }
    }
  } else {
    meets = false;
    refuse_path_through(b, to.pose);
    refuse_shear_of_nothing(to);
    if (!here.touching) start.pose = to.pose;
  }
  if (!meets) to.forced = to.turned = {};  // nothing to push against
  path.meets = path.meets || meets;
  path.to.push_back(to);
  return clear;
}

/// What holds a body where it is, by what leads it.
PartTarget held(const BodySnapshot& body, const PartTarget& to) {
  PartTarget hold = to;
  hold.pose = body.pose;
  hold.force = body.force;
  hold.torque = torque_on(body);
  if (!body.touching) hold.forced = hold.turned = {};
  return hold;
}

/// Each body that is led by a force and doesn't touch yet a little by its position first: a force has nothing to act on
/// yet. A body smaller than an edge may have to go deeper until a vertex meets it.
FiniteSnapshot FinitePress::Parts::touched_by_force(const Path& path, Effort& effort) {
  FiniteSnapshot at = path.start;
  for (int b = 0; b < count; ++b) {
    for (double depth = kFirstTouch; path.to[b].forced[2] && !at.bodies[b].touching; depth *= 2.0) {
      if (depth > kDeepestTouch) {
        fail("the press doesn't converge: no vertex touches within {:.3g} mm", kDeepestTouch * gel.thickness);
      }
      std::vector<PartTarget> first;
      for (int o = 0; o < count; ++o) first.push_back(held(at.bodies[o], path.to[o]));
      first[b].pose = path.to[b].pose;
      first[b].pose.translation.z() -= depth * gel.thickness;
      at = advanced(at, first, at, 0.0, 1.0, effort);
    }
  }
  return at;
}

/// Forces in parts that grow by a factor, other bodies being held where they are.
FiniteSnapshot FinitePress::Parts::grown_forces(const Path& path, FiniteSnapshot at, Effort& effort) {
  std::vector<ForceGrowth> growth;
  for (const PartTarget& to : path.to) growth.emplace_back(to.forced[2] ? to.force.z() : 0.0);
  while (true) {
    bool grows = false;
    std::vector<PartTarget> parts;
    for (int b = 0; b < count; ++b) {
      const PartTarget& to = path.to[b];
      parts.push_back(held(at.bodies[b], to));
      if (!to.forced[2]) continue;
      const std::optional<double> force = growth[b].next(at.bodies[b].force.z());
      if (!force) continue;
      grows = true;
      parts[b] = to;
      parts[b].force = to.force * (*force / to.force.z());
      parts[b].torque = to.torque * (*force / to.force.z());
    }
    if (!grows) return at;
    at = advanced(at, parts, at, 0.0, 1.0, effort);
  }
}

FiniteSnapshot FinitePress::Parts::follow(std::span<const PressTarget> targets, Effort& effort) {
  Path path{now, {}, false};
  double clear = 1.0;
  for (int b = 0; b < count; ++b) clear = std::min(clear, add_segment(b, targets[b], path));
  if (!path.meets) {
    for (int b = 0; b < count; ++b) path.start.bodies[b].pose = path.to[b].pose;
    return untouched(gel, path.start.bodies);
  }
  effort.clear = clear;
  if (!path.start.touching) path.start = untouched(gel, path.start.bodies);
  FiniteSnapshot at = grown_forces(path, touched_by_force(path, effort), effort);
  const FiniteSnapshot start = at;
  double parts = 1.0;
  for (int b = 0; b < count; ++b) {
    Eigen::Vector3d motion = path.to[b].pose.translation - start.bodies[b].pose.translation;
    for (int a = 0; a < 3; ++a) {
      if (path.to[b].forced[a]) motion[a] = 0.0;
    }
    const double most = std::min(kLargestPart * gel.thickness, tolerance.largest_motion);
    parts = std::max(parts, std::ceil(motion.norm() / most));
  }
  for (int part = 0; part < static_cast<int>(parts); ++part) {
    const double end = part + 1 >= parts ? 1.0 : (part + 1) / parts;
    at = advanced(start, path.to, at, part / parts, end, effort);
  }
  return at;
}

PressState FinitePress::Parts::report(const FiniteSnapshot& at) const {
  PressState s;
  s.node_state = at.state;
  s.traction = Eigen::MatrixX3d::Zero(n, 3);
  s.surface_displacement = Eigen::MatrixX3d::Zero(n, 3);
  s.bead_displacement = gel.bead_weight * at.elastic.displacement;
  s.largest_penetration = at.penetration;
  s.contact_residual = at.residual;
  s.node_owner.assign(n, -1);
  if (at.given.rows() > 0) s.object_gives = Eigen::VectorXd::Constant(n, std::numeric_limits<double>::quiet_NaN());
  for (const BodySnapshot& body : at.bodies) s.bodies.push_back({body.pose, {}, 0.0, 0});
  for (int b = 0; b < count; ++b) {
    if (at.bodies[b].touching) s.bodies[b].wrench << at.bodies[b].force, at.bodies[b].moment;
  }
  if (at.touching) {
    s.surface_displacement = mass.solve(gel.coupling * at.elastic.displacement);
    const double largest = at.pressure.maxCoeff();
    for (int v = 0; v < n; ++v) {
      if (at.state[v] == NodeState::open) continue;
      const int owner = s.node_owner[v] = at.owner[v];
      s.traction.row(v) = traction_at(gel, at, v).transpose();
      s.largest_tension = std::max(s.largest_tension, -at.pressure[v]);
      if (solver.bodies()[owner].elastic) {
        s.object_gives[v] = -gel.rest.normals[v].dot(at.given.row(v)) / gel.rest.weight[v];
      }
      const double mu = friction(owner);
      if (std::isfinite(mu) && mu > 0.0 && largest > 0.0) {
        const double excess = at.shear.row(v).norm() - mu * std::max(0.0, at.pressure[v]);
        s.cone_violation = std::max(s.cone_violation, excess / (mu * largest));
      }
      s.bodies[owner].contact_area += gel.rest.weight[v];
      ++s.bodies[owner].contact_vertices;
    }
    s.largest_gradient = largest_surface_gradient(gel.rest.vertices, gel.rest.triangles, s.surface_displacement);
    double deepest = 0.0;
    for (int v = 0; v < n; ++v) {
      deepest = std::max(deepest, std::abs(gel.rest.normals[v].dot(s.surface_displacement.row(v))));
    }
    s.largest_strain = std::max(s.largest_gradient, deepest / gel.thickness);
  }
  for (int b = 0; b < count; ++b) {
    s.contact_area += s.bodies[b].contact_area;
    s.contact_vertices += s.bodies[b].contact_vertices;
    const RigidTransform& pose = at.bodies[b].pose;
    const bool pressed = at.bodies[b].touching || solver.overlap(b, pose) > 0.0 || solver.tip_overlap(b, pose) > 0.0;
    s.under_resolved = s.under_resolved || (pressed && !is_resolved(gel.rest, s.node_owner, b));
  }
  s.gel_from_object = s.bodies.front().gel_from_object;
  s.wrench = s.bodies.front().wrench;
  return s;
}

/// The forces on the elastic gel that the wanted ones take, with what the gel remembers.
Eigen::Vector3d FinitePress::Parts::elastic_force(int body, const PressTarget& target, const PartTarget& to) const {
  const RelaxationStep step = relaxation_step(series, target.seconds);
  const Eigen::VectorXd rest = carried_over(step, history, 3 * n + 6 * count);
  Eigen::Vector3d force = to.force;
  for (int a = 0; a < 3; ++a) {
    // None is none: a gel that isn't pushed comes back with nothing on it.
    if (to.forced[a] && to.force[a] != 0.0) force[a] = (to.force[a] - rest[3 * n + 6 * body + a]) / step.stiffness;
  }
  return force;
}

/// From the elastic gel's tractions and wrenches to those of the gel that relaxes.
void FinitePress::Parts::relax(double seconds, double clear, PressState& elastic) {
  Eigen::VectorXd now_elastic(3 * n + 6 * count);
  for (int v = 0; v < n; ++v) now_elastic.segment<3>(3 * v) = elastic.traction.row(v).transpose();
  for (int b = 0; b < count; ++b) now_elastic.segment<6>(3 * n + 6 * b) = elastic.bodies[b].wrench;
  if (clear > 0.0) {  // nothing touches yet: what was there recovers
    const RelaxationStep before = relaxation_step(series, clear * seconds);
    history = after_step(before, history, carried_over(before, history, now_elastic.size()));
  }
  const RelaxationStep step = relaxation_step(series, (1.0 - clear) * seconds);
  const Eigen::VectorXd relaxed = step.stiffness * now_elastic + carried_over(step, history, now_elastic.size());
  history = after_step(step, history, relaxed);
  elastic.largest_tension = 0.0;
  const auto pulls = [&](int body) { return !(relaxed[3 * n + 6 * body + 2] > 0.0); };
  elastic.traction.setZero();
  for (int v = 0; v < n; ++v) {
    if (elastic.node_state[v] == NodeState::open || pulls(elastic.node_owner[v])) continue;
    elastic.traction.row(v) = relaxed.segment<3>(3 * v).transpose();
    const double pressure = elastic.traction.row(v).dot(now.gap.direction.row(v).normalized());
    elastic.largest_tension = std::max(elastic.largest_tension, -pressure);
  }
  for (int b = 0; b < count; ++b) {
    elastic.bodies[b].wrench.setZero();
    if (!pulls(b)) elastic.bodies[b].wrench = relaxed.segment<6>(3 * n + 6 * b);
  }
  elastic.wrench = elastic.bodies.front().wrench;
}

FinitePress::FinitePress(const FiniteGel& gel, std::vector<PressBody> bodies, PressTolerance tolerance,
                         PronySeries relaxation) {
  TS_ASSERT(!bodies.empty());
  check(relaxation);
  for (const PressBody& body : bodies) {
    check_shape(body.shape);
    if (!(body.friction >= 0.0)) fail("the friction coefficient is {}, it must be at least 0", body.friction);
    if (body.elastic && !relaxation.empty()) {
      fail("an elastic object can't be pressed at finite strain on a gel that relaxes");
    }
  }
  parts_ = std::make_unique<Parts>(gel, std::move(bodies), tolerance, std::move(relaxation));
}

FinitePress::FinitePress(const FiniteGel& gel, PressBody body, PressTolerance tolerance, PronySeries relaxation)
    : FinitePress(gel, std::vector{std::move(body)}, tolerance, std::move(relaxation)) {}

FinitePress::FinitePress(const FiniteGel& gel, ContactShape shape, double friction, PressTolerance tolerance,
                         PronySeries relaxation)
    : FinitePress(gel, PressBody{std::move(shape), friction, nullptr}, tolerance, std::move(relaxation)) {}

FinitePress::FinitePress(FinitePress&&) noexcept = default;
FinitePress& FinitePress::operator=(FinitePress&&) noexcept = default;
FinitePress::~FinitePress() = default;

const PressState& FinitePress::step(std::span<const PressTarget> targets) {
  Parts& p = *parts_;
  if (std::ssize(targets) != p.count) fail("{} targets are given for {} bodies", targets.size(), p.count);
  for (const PressTarget& target : targets) check_target(target);
  Effort effort;
  const std::shared_ptr<const FiniteTangent> before = p.solver.tangent();
  FiniteSnapshot next;
  try {
    next = p.follow(targets, effort);
  } catch (...) {
    p.solver.take_back(before);
    throw;
  }
  p.now = std::move(next);
  p.placed = true;
  p.state = p.report(p.now);
  if (!p.series.empty()) p.relax(targets.front().seconds, effort.clear, p.state);
  for (int b = 0; b < p.count; ++b) {
    const BodySnapshot& body = p.now.bodies[b];
    for (int a = 0; a < 3; ++a) {
      if (targets[b].axis[a].kind == AxisControl::Kind::force) {
        const double force = p.series.empty() ? body.force[a] : p.state.bodies[b].wrench[a];
        p.state.force_residual = std::max(p.state.force_residual, std::abs(force - targets[b].axis[a].value));
      }
      if (targets[b].torque[a] && body.touching) {
        p.state.torque_residual =
            std::max(p.state.torque_residual, std::abs(torque_on(body)[a] - *targets[b].torque[a]));
      }
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
  return parts_->straight_above(0, pose);
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
