#include "fem/finite_strain/finite_part.h"

#include <fmt/core.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "core/error.h"
#include "fem/contact/tip_gap.h"
#include "fem/finite_strain/finite_part_iterate.h"
#include "fem/finite_strain/finite_system.h"
#include "fem/finite_strain/finite_tangent.h"

namespace touchstone::fem {
namespace {

constexpr int kMostNewton = 25;         // with a tangent of their own
constexpr int kRowsAFactor = 60;        // to add so many to a tangent takes about as long as a new one
constexpr int kMostSteps = 100;         // with any
constexpr double kStepsAFactor = 15.0;  // a tangent that needs so many steps more is made anew: that takes as long
constexpr int kPlainSteps = 2;          // before Aitken's rule
constexpr int kTurningSteps = 10;       // after these the lines of contact stay,
constexpr double kNearlyRight = 100.0;  // and from this error on, of what is allowed
constexpr int kMostBacktracks = 5;
constexpr double kLeastShrink = 0.2;  // of the least J in one Newton step
constexpr double kLeastRatio = 0.1;   // J: below, elements deform as the gel can't
constexpr double kBalanced = 1e-8;    // residual over the elements' forces
constexpr double kAtRest = 1e-4;      // of the elements' forces at a part's start: below, a gel is as good as at rest
constexpr double kLargestTurn = 0.2;  // radians in one step, under torque control
constexpr double kReach = 0.5;        // of a vertex's own size: open gaps below this are candidates
constexpr double kInfinity = std::numeric_limits<double>::infinity();

using RowSparse = Eigen::SparseMatrix<double, Eigen::RowMajor>;

/// Columns: along the force of contact (into the gel) and two across it.
Eigen::Matrix3d axes_along(const Eigen::Vector3d& direction) {
  const Eigen::Vector3d first = direction.normalized();
  const Eigen::Vector3d guide = std::abs(first.x()) < 0.9 ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY();
  const Eigen::Vector3d second = (guide - guide.dot(first) * first).normalized();
  Eigen::Matrix3d axes;
  axes << first, second, first.cross(second);
  return axes;
}

}  // namespace

/// A step: unknowns and led axes without units, and the tractions at its end.
struct FinitePartSolver::Step {
  std::vector<int> block;
  ContactAnswer answer;
  Eigen::VectorXd change;
};

/// A block's laws as they are at an iterate, as in LawRows.
struct FinitePartSolver::Now {
  Eigen::VectorXd opening;    ///< gaps and slips, mm^3
  Eigen::VectorXd traction;   ///< MPa
  std::vector<int> rows;      ///< where each is in the tangent's compliance
  std::vector<int> held;      ///< rows of what touches, and the led axes of bodies that do
  Eigen::VectorXd stiffness;  ///< of the hold of each of these
};

FinitePartSolver::FinitePartSolver(const FiniteGel& gel, std::vector<PressBody> bodies, PressTolerance tolerance)
    : gel_(gel), bodies_(std::move(bodies)), tolerance_(tolerance), n_(static_cast<int>(gel.rest.vertices.size())) {
  for (const PressBody& body : bodies_) {
    soft_.push_back(body.elastic ? std::make_unique<ElasticBody>(*body.elastic) : nullptr);
    any_soft_ = any_soft_ || body.elastic;
    if (body.friction > 0.0) components_ = 3;
  }
}

double FinitePartSolver::overlap(int body, const RigidTransform& pose) const {
  return -deepest_gap(gel_.rest, bodies_[body].shape, pose);
}

double FinitePartSolver::tip_overlap(int body, const RigidTransform& pose) const {
  return -tip_gap(gel_.rest, bodies_[body].shape, pose);
}

/// The iterate's gap; along the lines and from the bodies there are, or new ones.
void FinitePartSolver::find_gaps(bool anew, Iterate& iterate, PartEffort& effort) const {
  FiniteSnapshot& at = iterate.at;
  const auto bodies = std::ssize(bodies_);
  std::vector<double> depths;
  for (int b = 0; b < bodies; ++b) depths.push_back(std::max(0.0, overlap(b, at.bodies[b].pose)));
  if (anew) {
    iterate.lines.clear();
    for (int b = 0; b < bodies; ++b) {
      iterate.lines.push_back(
          gap_lines(gel_.space, gel_.outer, at.elastic.displacement, bodies_[b].shape, at.bodies[b].pose, depths[b]));
    }
  }
  const auto gaps_of = [&] {
    std::vector<DeformedGap> gaps;
    for (int b = 0; b < bodies; ++b) {
      Eigen::VectorXd pressure = at.pressure;
      for (int v = 0; v < n_; ++v) {
        if (at.owner[v] != b) pressure[v] = 0.0;
      }
      gaps.push_back(deformed_gap(gel_.space, gel_.outer, gel_.rest.weight, iterate.lines[b], at.elastic.displacement,
                                  bodies_[b].shape, at.bodies[b].pose, depths[b], pressure));
    }
    ++effort.geometry_updates;
    return gaps;
  };
  std::vector<DeformedGap> gaps = gaps_of();
  if (anew) {
    bool handed_over = false;
    for (int v = 0; v < n_; ++v) {
      int nearest = -1;
      for (int b = 0; b < bodies; ++b) {
        if (gaps[b].weighted[v] < (nearest < 0 ? kInfinity : gaps[nearest].weighted[v])) nearest = b;
      }
      if (nearest == at.owner[v]) continue;
      at.owner[v] = nearest;
      if (at.state[v] == NodeState::open) continue;
      // What pushed there was another body.
      at.pressure[v] = 0.0;
      at.shear.row(v).setZero();
      at.state[v] = NodeState::open;
      handed_over = true;
    }
    if (handed_over) gaps = gaps_of();
  }
  at.gap = merged_gap(std::move(gaps), at.owner);
}

/// Gap, forces and residual at the iterate's state; along the lines there are, or new ones.
void FinitePartSolver::evaluate(bool anew, Iterate& iterate, PartEffort& effort) const {
  FiniteSnapshot& at = iterate.at;
  find_gaps(anew, iterate, effort);
  for (int v = 0; v < n_; ++v) {
    if (std::isfinite(at.gap.weighted[v])) continue;
    at.pressure[v] = 0.0;
    at.shear.row(v).setZero();
    at.state[v] = NodeState::open;
  }
  if (any_soft_) give_way(anew, iterate);
  iterate.axes.resize(n_);
  for (int v = 0; v < n_; ++v) {
    if (!std::isfinite(at.gap.weighted[v])) continue;
    iterate.axes[v] = axes_along(at.gap.direction.row(v));
    // The frame turns with the gel, and the traction with it.
    const Eigen::Vector3d normal = iterate.axes[v].col(0);
    at.shear.row(v) -= (at.shear.row(v) * normal) * normal.transpose();
  }
  Eigen::MatrixX3d nodal = Eigen::MatrixX3d::Zero(gel_.space.nodes, 3);
  Eigen::MatrixX3d bulges = nodal;
  iterate.bulges.resize(std::ssize(iterate.led));
  iterate.along.resize(std::ssize(iterate.led));
  for (int b = 0; b < std::ssize(bodies_); ++b) {
    const Eigen::MatrixX3d own_bulges = bulge_forces(gel_, at, b);
    const Eigen::MatrixX3d own = traction_forces(gel_, at, b);
    const Eigen::MatrixX3d both = own + own_bulges;
    BodySnapshot& body = at.bodies[b];
    body.force = -both.colwise().sum().transpose();
    body.moment.setZero();
    for (int node = 0; node < gel_.space.nodes; ++node) {
      const Eigen::Vector3d place = gel_.space.position(node) + at.elastic.displacement.row(node).transpose();
      body.moment -= place.cross(Eigen::Vector3d(both.row(node)));
    }
    for (Eigen::Index k = 0; k < iterate.along.size(); ++k) {
      const LedAxis& axis = iterate.led[static_cast<std::size_t>(k)];
      if (axis.body != b) continue;
      iterate.bulges[k] = work_along(axis, gel_, at, own_bulges);
      iterate.along[k] = -work_along(axis, gel_, at, both);
    }
    nodal += own;
    bulges += own_bulges;
  }
  const FiniteStrain::Residual residual = gel_.problem.residual(at.elastic);
  const Eigen::VectorXd outside = over_unknowns(gel_, nodal);
  iterate.inside = residual.values - over_unknowns(gel_, bulges);
  iterate.size = std::max({residual.scale, outside.norm(), iterate.least_size});
  iterate.balance = iterate.size > 0.0 ? (iterate.inside - outside).norm() / iterate.size : 0.0;
}

/// These and the vertices beside them that have a gap, rising.
std::vector<int> FinitePartSolver::with_those_beside(const FiniteSnapshot& at, std::vector<int> vertices) const {
  const std::size_t own = vertices.size();
  for (std::size_t k = 0; k < own; ++k) {
    for (const int u : gel_.rest.around[vertices[k]]) {
      if (std::isfinite(at.gap.weighted[u])) vertices.push_back(u);
    }
  }
  std::sort(vertices.begin(), vertices.end());
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  return vertices;
}

/// Vertices in contact and around it, and those that nearly touch.
std::vector<int> FinitePartSolver::candidates(const FiniteSnapshot& at) const {
  std::vector<int> result;
  for (int v = 0; v < n_; ++v) {
    if (!std::isfinite(at.gap.weighted[v])) continue;
    const double weight = gel_.rest.weight[v];
    const auto& around = gel_.rest.around[v];
    const bool beside =
        std::any_of(around.begin(), around.end(), [&](int u) { return at.state[u] != NodeState::open; });
    if (at.state[v] != NodeState::open || beside || at.gap.weighted[v] / weight < kReach * std::sqrt(weight)) {
      result.push_back(v);
    }
  }
  return result;
}

/// How far the vertex's hat has slid over the object since `from`, in the vertex's axes, mm^3.
Eigen::Vector2d FinitePartSolver::slid(const FiniteSnapshot& from, const FiniteSnapshot& at, int vertex,
                                       const Eigen::Matrix3d& axes) const {
  const int body = at.owner[vertex];
  const RigidTransform motion = at.bodies[body].pose * from.bodies[body].pose.inverse();
  Eigen::Vector3d slip = Eigen::Vector3d::Zero();
  for (RowSparse::InnerIterator it(gel_.coupling, vertex); it; ++it) {
    const int node = static_cast<int>(it.col());
    const Eigen::Vector3d place = gel_.space.position(node);
    const Eigen::Vector3d was = place + from.elastic.displacement.row(node).transpose();
    const Eigen::Vector3d is = place + at.elastic.displacement.row(node).transpose();
    slip += it.value() * (is - motion * was);
  }
  if (at.given.rows() > 0) slip += at.given.row(vertex).transpose();
  if (from.given.rows() > 0 && from.owner[vertex] == body) slip -= motion.turn(from.given.row(vertex).transpose());
  return axes.rightCols<2>().transpose() * slip;
}

/// The largest of the iterate's errors over what is allowed: at most 1 at a solution.
double FinitePartSolver::error_of(const FiniteSnapshot& from, std::span<const PartTarget> targets,
                                  const Iterate& iterate) const {
  const FiniteSnapshot& at = iterate.at;
  double error = iterate.balance / kBalanced;
  const double largest = at.pressure.maxCoeff();
  for (int v = 0; v < n_; ++v) {
    if (!std::isfinite(at.gap.weighted[v])) continue;
    const double gap = at.gap.weighted[v] / gel_.rest.weight[v];
    if (at.state[v] == NodeState::open) {
      if (at.pressure[v] > 1e-9 * largest) return kInfinity;  // a shortened step leaves some
      error = std::max(error, -gap / tolerance_.lookup_mm);
      continue;
    }
    error = std::max(error, std::abs(gap) / tolerance_.lookup_mm);
    const double mu = friction_at(at, v);
    if (mu == 0.0) continue;
    if (!(iterate.tangential_scale[v] > 0.0)) return kInfinity;
    // The laws of friction as a projection, as in contact_solver.h.
    const Eigen::Vector2d t = iterate.axes[v].rightCols<2>().transpose() * at.shear.row(v).transpose();
    Eigen::Vector2d kept = t - slid(from, at, v, iterate.axes[v]) / iterate.tangential_scale[v];
    const double limit = mu * std::max(0.0, at.pressure[v]);
    if (kept.norm() > limit) kept *= limit / kept.norm();
    error = std::max(error, (t - kept).norm() / (largest * std::max(1e-6, 100.0 * tolerance_.traction)));
  }
  for (Eigen::Index k = 0; k < iterate.along.size(); ++k) {
    const LedAxis& axis = iterate.led[static_cast<std::size_t>(k)];
    const double wanted = wanted_along(axis, targets);
    const double size = std::max(std::abs(wanted), axis.turns() ? at.bodies[axis.body].force.norm() : 0.0);
    const double allowed = tolerance_.force * std::max(1.0, size);
    error = std::max(error, std::abs(iterate.along[k] - wanted) / (0.5 * allowed));
  }
  return error;
}

/// Whether the tangent there is can be used for these vertices; it gets those that it lacks.
bool FinitePartSolver::cover(const Iterate& iterate, const std::vector<int>& block) {
  if (!tangent_ || tangent_->led != iterate.led) return false;
  std::vector<int> missing;
  std::set_difference(block.begin(), block.end(), tangent_->block.begin(), tangent_->block.end(),
                      std::back_inserter(missing));
  if (missing.empty()) return true;
  if (kRowsAFactor < tangent_->components * std::ssize(missing)) return false;
  missing = with_those_beside(iterate.at, std::move(missing));  // what will be next
  tangent_ = std::make_shared<const FiniteTangent>(with_vertices(*tangent_, gel_, iterate.at, iterate.axes, missing));
  return true;
}

/// Makes the tangent at the iterate, for its candidates and those beside them. False: why_not_ says why.
bool FinitePartSolver::factorise(const Iterate& iterate, PartEffort& effort) {
  tangent_.reset();
  std::vector<int> block = with_those_beside(iterate.at, candidates(iterate.at));
  try {
    tangent_ = std::make_shared<const FiniteTangent>(
        finite_tangent(gel_, iterate.at, iterate.axes, std::move(block), components_, iterate.led));
  } catch (const Error& singular) {
    why_not_ = singular.what();
    return false;
  }
  ++effort.factorisations;
  return true;
}

/// @pre the tangent covers the block
FinitePartSolver::Now FinitePartSolver::now_at(const FiniteSnapshot& from, const Iterate& iterate,
                                               const std::vector<int>& block) const {
  const FiniteSnapshot& at = iterate.at;
  const int c = tangent_->components;
  const auto m = static_cast<Eigen::Index>(block.size());
  const auto led = std::ssize(tangent_->led);
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(c * m + led);
  Now now{none, none, {}, {}, none};
  for (Eigen::Index j = 0; j < m; ++j) {
    const int v = block[static_cast<std::size_t>(j)];
    const auto place = std::lower_bound(tangent_->block.begin(), tangent_->block.end(), v) - tangent_->block.begin();
    now.opening[c * j] = at.gap.weighted[v];
    now.traction[c * j] = at.pressure[v];
    if (c == 3) {
      now.opening.segment<2>(c * j + 1) = slid(from, at, v, iterate.axes[v]);
      now.traction.segment<2>(c * j + 1) = iterate.axes[v].rightCols<2>().transpose() * at.shear.row(v).transpose();
    }
    for (int t = 0; t < c; ++t) {
      now.rows.push_back(static_cast<int>(c * place + t));
      if (at.state[v] == NodeState::open || (at.state[v] == NodeState::slip && t > 0)) continue;
      now.stiffness[std::ssize(now.held)] = hold_stiffness(gel_, v);
      now.held.push_back(static_cast<int>(c * j + t));
    }
  }
  for (Eigen::Index k = 0; k < led; ++k) {
    now.rows.push_back(static_cast<int>(c * std::ssize(tangent_->block) + k));
    const int body = tangent_->led[static_cast<std::size_t>(k)].body;
    const bool touches = std::any_of(block.begin(), block.end(),
                                     [&](int v) { return at.owner[v] == body && at.state[v] != NodeState::open; });
    if (!touches) continue;
    now.stiffness[std::ssize(now.held)] = shift_release(gel_);
    now.held.push_back(static_cast<int>(c * m + k));
  }
  now.stiffness.conservativeResize(std::ssize(now.held));
  return now;
}

/// The contact problem on the tangent's compliance. False: why_not_ says why. @pre the tangent covers the block
bool FinitePartSolver::find_step(const FiniteSnapshot& from, std::span<const PartTarget> targets, Iterate& iterate,
                                 Step& step, PartEffort& effort) {
  const FiniteSnapshot& at = iterate.at;
  const double length = gel_.problem.scales().length;
  const double unit = force_scale(gel_);
  const std::vector<LedAxis>& led = tangent_->led;
  const int c = tangent_->components;
  const auto m = static_cast<Eigen::Index>(step.block.size());
  const LawRows laws = law_rows(gel_, at, iterate.axes, step.block, c, led);
  const Now now = now_at(from, iterate, step.block);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(laws.inner);
  const auto push = [&](const Eigen::VectorXd& by) {
    for (std::size_t r = 0; r < laws.rows.size(); ++r) {
      for (const auto& [i, x] : laws.rows[r]) right[i] += x * by[static_cast<Eigen::Index>(r)] / unit;
    }
  };
  right.head(gel_.space.unknowns) = -iterate.inside;
  for (Eigen::Index k = 0; k < std::ssize(led); ++k) {
    right[gel_.space.unknowns + k] =
        -(wanted_along(led[static_cast<std::size_t>(k)], targets) + iterate.bulges[k]) / unit;
  }
  push(now.traction);
  // Where gel and object would go with the tractions that there are, and from there without them.
  const Eigen::VectorXd back = tangent_->factor->solve(right);
  ContactLaws free{tangent_->compliance(now.rows, now.rows), now.opening};
  if (any_soft_) add_given(iterate, step.block, c, free.compliance);
  for (std::size_t r = 0; r < laws.rows.size(); ++r) {
    for (const auto& [i, x] : laws.rows[r]) free.ahead[static_cast<Eigen::Index>(r)] += length * x * back[i];
  }
  free.ahead -= free.compliance * now.traction;
  const ContactLaws stiff = held_stiffly(free, now.held, now.stiffness);
  const Eigen::VectorXd& ahead = stiff.ahead;
  ContactProblem contact;
  const Eigen::MatrixXd of_vertices = stiff.compliance.topLeftCorner(c * m, c * m);
  contact.compliance.emplace(of_vertices);
  contact.components = c;
  contact.friction.resize(m);
  contact.gap.resize(m);
  contact.border.resize(c * m, 0);
  if (c == 3) contact.drag.resize(2 * m);
  iterate.tangential_scale = Eigen::VectorXd::Zero(n_);
  for (Eigen::Index j = 0; j < m; ++j) {
    const int v = step.block[static_cast<std::size_t>(j)];
    contact.gap[j] = ahead[c * j];
    contact.friction[j] = friction_at(at, v);
    if (c == 1) continue;
    contact.drag.segment<2>(2 * j) = -ahead.segment<2>(c * j + 1);
    const auto scale = [&](Eigen::Index row) { return stiff.compliance(row, row); };
    iterate.tangential_scale[v] = std::max(scale(c * j + 1), scale(c * j + 2));
  }
  const Eigen::VectorXd start = at.touching ? Eigen::VectorXd(now.traction.head(c * m)) : Eigen::VectorXd();
  ContactMemory memory;
  step.answer = c == 1 ? solve_frictionless(contact, start, memory)
                       : solve_frictional(contact, start, std::max(tolerance_.traction, 1e-10), memory);
  effort.solves += step.answer.iterations;
  effort.sweeps += step.answer.sweeps;
  if (!step.answer.converged) {
    why_not_ =
        fmt::format("the contact laws have no answer to be found with {} candidates: the gel isn't stable there", m);
    return false;
  }
  // The hold's own forces count, too: it amplifies what the answer leaves of the laws, which would else be seen.
  Eigen::VectorXd load = -now.traction;
  load.head(c * m) += step.answer.z;
  const Eigen::VectorXd left = stiff.ahead + stiff.compliance.leftCols(c * m) * step.answer.z;
  for (std::size_t k = 0; k < now.held.size(); ++k) {
    load[now.held[k]] -= now.stiffness[static_cast<Eigen::Index>(k)] * left[now.held[k]];
  }
  right.setZero();
  push(load);
  step.change = back + tangent_->factor->solve(right);
  return true;
}

/// Moves them by `factor` of the step. False: why_not_ says why.
bool FinitePartSolver::move_bodies(const Step& step, double factor, std::vector<BodySnapshot>& bodies) {
  const std::vector<LedAxis>& led = tangent_->led;
  std::vector<Eigen::Vector3d> turns(bodies.size(), Eigen::Vector3d::Zero());
  for (std::size_t k = 0; k < led.size(); ++k) {
    const double by =
        factor * gel_.problem.scales().length * step.change[gel_.space.unknowns + static_cast<Eigen::Index>(k)];
    if (led[k].turns()) {
      turns[led[k].body][led[k].axis - 3] += by / led[k].arm;
    } else {
      bodies[led[k].body].pose.translation[led[k].axis] += by;
    }
  }
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    BodySnapshot& body = bodies[b];
    if (!turns[b].isZero(0.0)) {
      if (!(turns[b].norm() <= kLargestTurn)) {
        why_not_ = fmt::format("a step turns the object by {:.2g} rad", turns[b].norm());
        return false;
      }
      body.turn += turns[b];
      if (body.turn.norm() > kMostTurn) {
        why_not_ = fmt::format("the object turns over: torque control has turned it by more than {} rad", kMostTurn);
        return false;
      }
      body.pose.rotation = turned_by(turns[b]) * body.pose.rotation;
    }
    if (!body.pose.translation.allFinite() || overlap(static_cast<int>(b), body.pose) > 0.98 * gel_.thickness) {
      why_not_ = fmt::format("the wanted force needs the object deeper than the gel's {:.4g} mm", gel_.thickness);
      return false;
    }
  }
  return true;
}

/// Goes by `factor` of the step, or less where a tetrahedron would turn inside out. False: why_not_ says why.
bool FinitePartSolver::take_step(const Step& step, double& factor, Iterate& iterate) {
  FiniteSnapshot& at = iterate.at;
  const int c = components_;
  for (int tries = 0;; factor *= 0.5, ++tries) {
    if (tries > kMostBacktracks) return false;
    ElasticSolution next = gel_.problem.moved(at.elastic, step.change, factor);
    const double ratio = gel_.problem.smallest_volume_ratio(next);
    if (!(ratio > kLeastShrink * iterate.least)) {
      why_not_ = fmt::format("a tetrahedron turns inside out (its volume falls to {:.2g} of what it was)", ratio);
      continue;
    }
    std::vector<BodySnapshot> bodies = at.bodies;
    if (!move_bodies(step, factor, bodies)) continue;
    iterate.least = ratio;
    at.elastic = std::move(next);
    at.bodies = std::move(bodies);
    break;
  }
  at.pressure *= 1.0 - factor;
  at.shear *= 1.0 - factor;
  at.state.assign(n_, NodeState::open);
  at.touching = false;
  for (BodySnapshot& body : at.bodies) body.touching = false;
  at.residual = step.answer.residual;
  for (std::size_t k = 0; k < step.block.size(); ++k) {
    const auto j = static_cast<Eigen::Index>(k);
    const int v = step.block[k];
    at.state[v] = step.answer.state[k];
    if (at.state[v] != NodeState::open) at.touching = at.bodies[at.owner[v]].touching = true;
    at.pressure[v] += factor * step.answer.z[c * j];
    if (c == 3) {
      at.shear.row(v) += factor * (iterate.axes[v].rightCols<2>() * step.answer.z.segment<2>(c * j + 1)).transpose();
    }
  }
  return true;
}

/// What a converged iterate has found. Nothing: why_not_ says why.
std::optional<FiniteSnapshot> FinitePartSolver::finished(Iterate iterate) {
  if (iterate.least < kLeastRatio) {
    why_not_ = fmt::format("a tetrahedron keeps but {:.2g} of its volume: the mesh is too coarse where it's strained",
                           iterate.least);
    return std::nullopt;
  }
  FiniteSnapshot& found = iterate.at;
  if (!found.touching) return untouched(gel_, found.bodies);
  found.penetration = 0.0;
  for (int v = 0; v < n_; ++v) {
    if (!std::isfinite(found.gap.weighted[v])) continue;
    found.penetration = std::max(found.penetration, -found.gap.weighted[v] / gel_.rest.weight[v]);
  }
  return std::move(found);
}

std::optional<FiniteSnapshot> FinitePartSolver::solve(const FiniteSnapshot& from, std::span<const PartTarget> targets,
                                                      PartEffort& effort) {
  Iterate iterate;
  iterate.at = from;
  iterate.led = led_axes(targets, bodies_);
  for (std::size_t b = 0; b < targets.size(); ++b) iterate.at.bodies[b].pose = targets[b].pose;
  iterate.least = gel_.problem.smallest_volume_ratio(from.elastic);
  evaluate(true, iterate, effort);
  iterate.least_size = kAtRest * iterate.size;
  Eigen::VectorXd last_change;
  double factor = 1.0;
  double error = kInfinity;
  bool slow = false;
  int made = 0;
  for (int iteration = 1; iteration <= kMostSteps && made <= kMostNewton; ++iteration) {
    Step step;
    step.block = candidates(iterate.at);
    for (const LedAxis& axis : iterate.led) {
      if (std::any_of(step.block.begin(), step.block.end(), [&](int v) { return iterate.at.owner[v] == axis.body; }))
        continue;
      why_not_ = "the object has lost the gel";
      return std::nullopt;
    }
    if (step.block.empty()) return untouched(gel_, iterate.at.bodies);
    effort.candidates = std::max(effort.candidates, static_cast<int>(step.block.size()));
    const auto go = [&](bool anew) {
      if (anew && !factorise(iterate, effort)) return false;
      if (!find_step(from, targets, iterate, step, effort)) return false;
      // Aitken's rule [Irons1969] against steps that alternate.
      double next_factor = 1.0;
      if (iteration > kPlainSteps) {
        const double ratio = step.change.dot(last_change) / last_change.squaredNorm();
        if (ratio < 0.0) next_factor = std::clamp(factor / (1.0 - ratio), 0.1, 1.0);
      }
      if (!take_step(step, next_factor, iterate)) return false;
      factor = next_factor;
      return true;
    };
    // What fails with an old tangent, or leads away, is tried again with a new one.
    bool anew = slow || !cover(iterate, step.block);
    const double last_factor = factor;
    std::optional<Iterate> before;
    if (!anew) before = iterate;
    bool gone = go(anew);
    if (!gone && !anew) gone = go(anew = true);
    if (!gone) return std::nullopt;
    made += anew;
    // How the lines turn, and which of them hit, isn't in the tangent. It hardly matters but at an edge as narrow as
    // the mesh, where Newton's steps may alternate; so the lines stay once they are nearly right.
    evaluate(iteration < kTurningSteps && error > kNearlyRight, iterate, effort);
    const double last_error = error;
    error = error_of(from, targets, iterate);
    slow = !anew && !(std::log(error) < kStepsAFactor * std::log(last_error / error));
    if (!anew && iteration > 1 && !(error < last_error)) {
      iterate = std::move(*before);
      error = last_error;
      factor = last_factor;
      continue;
    }
    last_change = step.change;
    if (error <= 1.0) {
      if (!any_soft_) return finished(std::move(iterate));
      // An elastic object's lines aren't closed: where it gives way must be right, too.
      Iterate looked_at = iterate;
      evaluate(true, looked_at, effort);
      const double left = error_of(from, targets, looked_at);
      if (left <= kNearlyRight) return finished(std::move(iterate));
      iterate = std::move(looked_at);
      error = left;
    }
    if (!std::isfinite(iterate.balance)) break;
  }
  why_not_ = fmt::format("Newton's method is {:.2g} times its tolerance off with {} tangents", error, made);
  return std::nullopt;
}

}  // namespace touchstone::fem
