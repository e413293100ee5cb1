#include "fem/press_part.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/error.h"

namespace touchstone::fem {
namespace {

constexpr int kMostUpdates = 60;
constexpr int kStrictUpdates = 8;        // after these the lookup may be a hundred times further off
constexpr int kPlainUpdates = 5;         // after these the fixed point is relaxed
constexpr double kSurelyTouching = 0.3;  // of the deepest overlap: vertices that overlap by more start in the block
constexpr std::size_t kFirstCandidates = 12;

/// Turns an answer without friction into one with three components a vertex.
void widen(ContactAnswer& answer, const Eigen::MatrixXd& compliance) {
  const Eigen::VectorXd p = answer.z;
  answer.z = Eigen::VectorXd::Zero(3 * p.size());
  answer.response = Eigen::VectorXd::Zero(3 * p.size());
  for (Eigen::Index j = 0; j < p.size(); ++j) {
    answer.z[3 * j] = p[j];
    if (p[j] != 0.0) answer.response += p[j] * compliance.col(3 * j);
  }
}

}  // namespace

/// What changes while a part is solved.
struct PartSolver::Iterate {
  RigidTransform pose;
  std::vector<Eigen::Vector3d> lookup;  ///< the gel's displacement where the gap is looked up, per vertex
  std::vector<Eigen::Vector3d> last_residual;
  double relaxation = 1.0;
  double lookup_error = 0.0;
  std::vector<char> active;    ///< vertices in contact
  std::vector<char> required;  ///< vertices that turned out to be needed in the block
  Eigen::VectorXd traction;    ///< to begin the next solution with
  bool warm = false;
  bool grew = false;  ///< `required` was added to
  int updates = 0;
  int at_the_bottom = 0;      ///< updates that wanted to go deeper than the gel
  Eigen::VectorXd predicted;  ///< per block vertex: the gap after the last shift
  double edge_change = 0.0;   ///< mm: what the shift does to the gaps at the silhouette, beyond moving them
};

PressSnapshot untouched(const RigidTransform& pose, int n) {
  PressSnapshot s;
  s.pose = pose;
  s.traction = Eigen::VectorXd::Zero(3 * n);
  s.weighted = Eigen::VectorXd::Zero(3 * n);
  s.state.assign(n, NodeState::open);
  return s;
}

PartSolver::PartSolver(const Compliance& gel, ContactShape shape, double lookup_mm, double traction,
                       PronySeries relaxation)
    : gel_(gel),
      shape_(std::move(shape)),
      lookup_mm_(lookup_mm),
      traction_(traction),
      relaxation_(std::move(relaxation)),
      surface_(gel),
      block_(gel, surface_) {
  for (const auto& normal : surface_.normals) flat_ = flat_ && normal == surface_.normals.front();
}

void PartSolver::set_friction(double friction) {
  if (friction != friction_) memory_.forget();
  friction_ = friction;
}

void PartSolver::refuse_too_deep(double deepest) const {
  if (-deepest > gel_.thickness) {
    fail("the object reaches {:.4g} mm into a gel of {:.4g} mm", -deepest, gel_.thickness);
  }
}

Eigen::Vector3d PartSolver::lumped(const Eigen::VectorXd& weighted, int vertex) const {
  return weighted.segment<3>(3 * vertex) / surface_.weight[vertex];
}

/// Vertices that surely or probably touch, with a ring around them.
std::vector<int> PartSolver::candidates(const WeightedGap& gap, const Iterate& now, bool z_forced) const {
  const int n = static_cast<int>(gel_.vertices.size());
  std::vector<std::pair<double, int>> near;
  std::size_t touching = 0;
  for (int v = 0; v < n; ++v) {
    touching += now.active[v] != 0;
    if (std::isfinite(gap.weighted[v])) near.emplace_back(gap.weighted[v] / surface_.weight[v], v);
  }
  std::sort(near.begin(), near.end());
  const double depth = std::max(0.0, -gap.deepest);
  std::size_t count = 0;
  while (count < near.size() && near[count].first < -kSurelyTouching * depth) ++count;
  // While the depth is itself being sought it may be far off; the block grows by a factor at a time.
  if (z_forced) count = std::min(count, 4 * touching + kFirstCandidates);
  count = std::max(count, std::min(near.size(), kFirstCandidates));
  std::vector<char> chosen(now.active);
  for (int v = 0; v < n; ++v) chosen[v] = chosen[v] || now.required[v];
  for (std::size_t k = 0; k < count; ++k) chosen[near[k].second] = 1;
  std::vector<int> result;
  for (int v = 0; v < n; ++v) {
    if (!std::isfinite(gap.weighted[v])) continue;
    const bool beside = std::any_of(surface_.around[v].begin(), surface_.around[v].end(),
                                    [&](int neighbour) { return chosen[neighbour] != 0; });
    if (chosen[v] || beside) result.push_back(v);
  }
  return result;
}

/// Weighted tangential displacement, in the vertices' own axes, that the gel would have at the block's vertices if it
/// had gone along with the object since `from`.
Eigen::VectorXd PartSolver::drag(const PressSnapshot& from, const RigidTransform& pose) const {
  const RigidTransform motion = pose * from.pose.inverse();
  const Eigen::Vector3d translation = pose.translation - from.pose.translation;
  const bool translated = pose.rotation == from.pose.rotation;
  const auto& vertices = block_.vertices();
  Eigen::VectorXd result(2 * static_cast<Eigen::Index>(vertices.size()));
  for (std::size_t k = 0; k < vertices.size(); ++k) {
    const int v = vertices[k];
    Eigen::Vector3d weighted = from.weighted.segment<3>(3 * v);
    if (translated) {
      weighted += surface_.weight[v] * translation;
    } else {
      for (Eigen::SparseMatrix<double>::InnerIterator it(gel_.mass, v); it; ++it) {
        const int u = static_cast<int>(it.row());
        const Eigen::Vector3d at = gel_.vertices[u] + lumped(from.weighted, u);
        weighted += it.value() * (motion * at - at);
      }
    }
    result.segment<2>(2 * static_cast<Eigen::Index>(k)) = block_.axes(v).rightCols<2>().transpose() * weighted;
  }
  return result;
}

PatchMotion PartSolver::motion_of(const std::vector<int>& vertices, const std::vector<Eigen::Vector3d>& displacements,
                                  const std::vector<double>& pressures) const {
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector3d> normals;
  for (const int v : vertices) {
    points.push_back(gel_.vertices[v]);
    normals.push_back(surface_.normals[v]);
  }
  return mean_patch_motion(points, normals, displacements, pressures);
}

/// Begins with the state of `from`; the lookup goes on with the object if most of the contact stuck.
void PartSolver::begin(const PressSnapshot& from, Iterate& now) const {
  const int n = static_cast<int>(gel_.vertices.size());
  std::vector<int> vertices;
  std::vector<Eigen::Vector3d> displacements;
  std::vector<double> pressures;
  int stuck = 0;
  now.active.assign(n, 0);
  now.required.assign(n, 0);
  for (int v = 0; v < n; ++v) {
    if (from.state[v] == NodeState::open) continue;
    now.active[v] = 1;
    vertices.push_back(v);
    displacements.push_back(lumped(from.weighted, v));
    pressures.push_back(-surface_.weight[v] * surface_.normals[v].dot(from.traction.segment<3>(3 * v)));
    stuck += from.state[v] == NodeState::stick;
  }
  if (2 * stuck > static_cast<int>(vertices.size())) {
    const RigidTransform motion = now.pose * from.pose.inverse();
    for (std::size_t k = 0; k < vertices.size(); ++k) {
      const Eigen::Vector3d at = gel_.vertices[vertices[k]] + displacements[k];
      displacements[k] += motion * at - at;
    }
  }
  const PatchMotion patch = motion_of(vertices, displacements, pressures);
  now.lookup.resize(n);
  for (int v = 0; v < n; ++v) now.lookup[v] = patch.displacement(gel_.vertices[v]);
  now.traction = from.traction;
  now.warm = from.touching;
}

ContactProblem PartSolver::problem(const WeightedGap& gap, const PressSnapshot& from, const PartTarget& target,
                                   const Iterate& now) const {
  const int c = friction_ > 0.0 ? 3 : 1;
  const auto& vertices = block_.vertices();
  const auto m = static_cast<Eigen::Index>(vertices.size());
  std::vector<int> axes;
  for (int a = 0; a < 3; ++a) {
    if (target.forced[a]) axes.push_back(a);
  }
  const auto k = static_cast<Eigen::Index>(axes.size());
  ContactProblem result;
  result.compliance = c == 1 ? &block_.normal_compliance() : &block_.compliance();
  result.components = c;
  result.friction = friction_;
  result.gap.resize(m);
  result.border.resize(c * m, k);
  result.force.resize(k);
  for (Eigen::Index b = 0; b < k; ++b) result.force[b] = target.force[axes[b]];
  for (Eigen::Index j = 0; j < m; ++j) {
    const int v = vertices[j];
    result.gap[j] = gap.weighted[v];
    for (Eigen::Index b = 0; b < k; ++b) {
      result.border.block(c * j, b, c, 1) = -surface_.weight[v] * block_.axes(v).leftCols(c).row(axes[b]).transpose();
    }
  }
  if (c == 3) result.drag = drag(from, now.pose);
  return result;
}

// With relaxation a step's weighted displacement is (H0 t - H0 r) / G of the traction t (relaxation.h). Multiplied by
// G, the contact laws are those of the unrelaxed compliance H0 with other gaps and drags, so factors stay what they
// are.

void PartSolver::relax(ContactProblem& contact) const {
  if (carried_.size() == 0) return;
  const double g = relaxation_step_.stiffness;
  const auto& vertices = block_.vertices();
  const auto n = static_cast<Eigen::Index>(gel_.vertices.size());
  for (Eigen::Index j = 0; j < contact.gap.size(); ++j) {
    const int v = vertices[j];
    const Eigen::Vector3d own = block_.axes(v).transpose() * carried_.segment<3>(3 * (n + v));
    contact.gap[j] = g * contact.gap[j] - own[0];
    if (contact.components == 3) contact.drag.segment<2>(2 * j) = g * contact.drag.segment<2>(2 * j) + own.tail<2>();
  }
}

void PartSolver::relax(ContactAnswer& answer) const {
  if (carried_.size() == 0) return;
  const double g = relaxation_step_.stiffness;
  const auto& vertices = block_.vertices();
  const auto n = static_cast<Eigen::Index>(gel_.vertices.size());
  answer.shift /= g;
  for (Eigen::Index j = 0; j < static_cast<Eigen::Index>(vertices.size()); ++j) {
    const int v = vertices[j];
    const Eigen::Vector3d own = block_.axes(v).transpose() * carried_.segment<3>(3 * (n + v));
    answer.response.segment<3>(3 * j) = (answer.response.segment<3>(3 * j) - own) / g;
  }
}

/// Turns the elastic answer H0 t in `next.weighted` into the relaxed one, and keeps what the gel remembers.
void PartSolver::remember(const RelaxationStep& step, const PressSnapshot& from, PressSnapshot& next) const {
  if (relaxation_.empty() || (from.history.empty() && !next.touching)) return;
  Eigen::VectorXd both(next.traction.size() + next.weighted.size());
  both << next.traction, next.weighted;
  next.history = after_step(step, from.history, both);
  next.weighted = next.history.elastic.tail(next.weighted.size());
}

PressSnapshot PartSolver::apart(const PressSnapshot& from, const RigidTransform& pose, double seconds) const {
  PressSnapshot next = untouched(pose, static_cast<int>(gel_.vertices.size()));
  if (!relaxation_.empty()) remember(relaxation_step(relaxation_, seconds), from, next);
  return next;
}

/// Whether the gel, not yet recovered from an earlier press, would stand out into the body if nothing touched it.
bool PartSolver::bulges_into(const WeightedGap& gap) const {
  if (carried_.size() == 0) return false;
  const auto n = static_cast<Eigen::Index>(gel_.vertices.size());
  for (Eigen::Index v = 0; v < n; ++v) {
    const double out = -surface_.normals[v].dot(carried_.segment<3>(3 * (n + v))) / relaxation_step_.stiffness;
    if (gap.weighted[v] < out) return true;
  }
  return false;
}

/// Moves the pose by what the forces ask for, no faster than the block can follow. False if the object slides away.
bool PartSolver::take_shift(const ContactAnswer& answer, const WeightedGap& gap, const PartTarget& target,
                            Iterate& now) {
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
  Eigen::Index next = 0;
  for (int a = 0; a < 3; ++a) {
    if (target.forced[a]) shift[a] = answer.shift[next++];
  }
  if (!shift.allFinite() || shift.head<2>().norm() > 4.0 * gel_.thickness) {
    why_not_ = fmt::format("the object slides away by more than {:.3g} mm", 4.0 * gel_.thickness);
    return false;
  }
  const double depth = std::max(0.0, -gap.deepest);
  const double limit = std::min(0.98 * gel_.thickness, std::max(4.0 * depth, 0.02 * gel_.thickness));
  if (shift.z() < 0.0 && depth - shift.z() > limit) {
    if (depth > 0.97 * gel_.thickness && ++now.at_the_bottom > 20) {
      fail("the wanted force of {:.4g} N needs the object deeper than the gel's {:.4g} mm", target.force[2],
           gel_.thickness);
    }
    shift.z() = std::min(0.0, depth - limit);
    now.grew = true;  // not an answer yet
  }
  now.pose.translation += shift;
  const auto& vertices = block_.vertices();
  const auto m = static_cast<Eigen::Index>(vertices.size());
  now.predicted.resize(m);
  now.edge_change = flat_ ? 0.0 : shift.norm();
  for (Eigen::Index j = 0; j < m; ++j) {
    const int v = vertices[j];
    const double normal_shift = surface_.normals[v].dot(shift);
    now.predicted[j] = gap.weighted[v] + surface_.weight[v] * normal_shift;
    if (answer.state[j] != NodeState::open) {
      now.edge_change = std::max(now.edge_change, gap.edge[v] / surface_.weight[v] * std::abs(normal_shift));
    }
  }
  for (int v = 0; v < static_cast<int>(gel_.vertices.size()); ++v) {
    now.lookup[v] += shift - surface_.normals[v].dot(shift) * surface_.normals[v];  // what sticks goes along
  }
  return true;
}

/// How far the lookup is from the contact patch's mean motion: `lookup_error`, and the residual for the next lookup.
void PartSolver::follow_patch(const ContactAnswer& answer, Iterate& now) const {
  const auto& vertices = block_.vertices();
  std::vector<Eigen::Vector3d> displacements(vertices.size());
  std::vector<double> pressures(vertices.size());
  std::fill(now.active.begin(), now.active.end(), 0);
  now.traction.setZero();
  for (std::size_t k = 0; k < vertices.size(); ++k) {
    const auto j = static_cast<Eigen::Index>(k);
    const int v = vertices[k];
    now.active[v] = answer.state[k] != NodeState::open;
    now.traction.segment<3>(3 * v) = block_.axes(v) * answer.z.segment<3>(3 * j);
    displacements[k] = block_.axes(v) * answer.response.segment<3>(3 * j) / surface_.weight[v];
    pressures[k] = std::max(0.0, answer.z[3 * j]) * surface_.weight[v];
  }
  now.warm = true;
  const PatchMotion patch = motion_of(vertices, displacements, pressures);
  std::vector<Eigen::Vector3d> residual(gel_.vertices.size());
  now.lookup_error = 0.0;
  double cross = 0.0;
  double square = 0.0;
  for (std::size_t v = 0; v < residual.size(); ++v) {
    residual[v] = patch.displacement(gel_.vertices[v]) - now.lookup[v];
    if (now.active[v]) now.lookup_error = std::max(now.lookup_error, residual[v].norm());
    if (!now.last_residual.empty()) {
      const Eigen::Vector3d difference = residual[v] - now.last_residual[v];
      cross += now.last_residual[v].dot(difference);
      square += difference.squaredNorm();
    }
  }
  // Aitken's rule for vectors (Irons and Tuck 1969) where the plain fixed point is slow.
  if (now.updates > kPlainUpdates && square > 0.0) {
    now.relaxation = std::clamp(-now.relaxation * cross / square, 0.1, 1.0);
  }
  now.last_residual = std::move(residual);
}

/// The answer over all vertices, by the one pass over the whole compliance; nothing if a vertex outside the block
/// penetrates, which is then required.
std::optional<PressSnapshot> PartSolver::accept(const ContactAnswer& answer, const PressSnapshot& from, Iterate& now,
                                                PartEffort& effort) const {
  const int n = static_cast<int>(gel_.vertices.size());
  const auto& vertices = block_.vertices();
  PressSnapshot next = untouched(now.pose, n);
  double deepest = 0.0;
  for (std::size_t k = 0; k < vertices.size(); ++k) {
    const auto j = static_cast<Eigen::Index>(k);
    const int v = vertices[k];
    const double g = now.predicted[j] + answer.response[3 * j];
    if (std::isfinite(g)) deepest = std::max(deepest, -g / surface_.weight[v]);
    if (answer.state[k] == NodeState::open) continue;
    next.state[v] = answer.state[k];
    next.traction.segment<3>(3 * v) = now.traction.segment<3>(3 * v);
    next.weighted.noalias() += gel_.surface.middleCols<3>(3 * v) * next.traction.segment<3>(3 * v);
    next.force -= surface_.weight[v] * next.traction.segment<3>(3 * v);
    next.touching = true;
  }
  remember(relaxation_step_, from, next);
  const WeightedGap gap = weighted_gap(surface_, shape_, now.pose, now.lookup);
  ++effort.geometry_updates;
  refuse_too_deep(gap.deepest);
  for (int v = 0; v < n; ++v) {
    if (!std::isfinite(gap.weighted[v]) || block_.place(v) >= 0) continue;
    const double g = (gap.weighted[v] - surface_.normals[v].dot(next.weighted.segment<3>(3 * v))) / surface_.weight[v];
    if (-g > lookup_mm_) {
      now.required[v] = 1;
      now.grew = true;
    }
    deepest = std::max(deepest, -g);
  }
  if (now.grew) return std::nullopt;
  next.overlapping = gap.deepest < 0.0;
  if (carried_.size() > 0) {  // the face isn't flat: a body may hang in the dent of an earlier press
    next.overlapping = false;
    for (int v = 0; v < n && !next.overlapping; ++v) {
      next.overlapping = gap.lowest[v] < surface_.normals[v].dot(lumped(next.weighted, v));
    }
  }
  next.penetration = deepest;
  next.lookup_error = now.lookup_error;
  next.residual = answer.residual;
  effort.candidates = std::max(effort.candidates, static_cast<int>(vertices.size()));
  return next;
}

std::optional<PressSnapshot> PartSolver::solve(const PressSnapshot& from, const PartTarget& target,
                                               PartEffort& effort) {
  const int n = static_cast<int>(gel_.vertices.size());
  if (target.forced != remembered_axes_) memory_.forget();
  remembered_axes_ = target.forced;
  Iterate now;
  now.pose = target.pose;
  begin(from, now);
  if (!relaxation_.empty()) {
    relaxation_step_ = relaxation_step(relaxation_, target.seconds);
    carried_ = carried_over(relaxation_step_, from.history, 6 * static_cast<Eigen::Index>(n));
  }
  std::vector<char> wanted;  // empty: all vertices
  for (now.updates = 0; now.updates < kMostUpdates; ++now.updates) {
    const WeightedGap gap = weighted_gap(surface_, shape_, now.pose, now.lookup, wanted);
    ++effort.geometry_updates;
    if (target.forced[2]) {
      if (!std::isfinite(gap.deepest)) {
        fail("the object isn't over the gel: a force of {:.4g} N can't be reached", target.force[2]);
      }
    } else {
      refuse_too_deep(gap.deepest);
      const bool alone = std::none_of(now.active.begin(), now.active.end(), [](char x) { return x != 0; });
      if (alone && gap.deepest >= 0.0 && !bulges_into(gap)) return apart(from, now.pose, target.seconds);
    }
    for (int v = 0; v < n; ++v) {
      if (!std::isfinite(gap.weighted[v])) now.active[v] = now.required[v] = 0;
    }
    if (block_.hold(candidates(gap, now, target.forced[2]))) memory_.forget();
    const auto& vertices = block_.vertices();
    if (vertices.empty()) return apart(from, now.pose, target.seconds);

    ContactProblem contact = problem(gap, from, target, now);
    relax(contact);
    const int c = contact.components;
    Eigen::VectorXd start(now.warm ? c * contact.gap.size() : 0);
    for (Eigen::Index j = 0; now.warm && j < contact.gap.size(); ++j) {
      const int v = vertices[j];
      start.segment(c * j, c) = block_.axes(v).leftCols(c).transpose() * now.traction.segment<3>(3 * v);
    }
    ContactAnswer answer =
        c == 1 ? solve_frictionless(contact, start, memory_) : solve_frictional(contact, start, traction_, memory_);
    effort.solves += answer.iterations;
    effort.factorisations += answer.factorisations;
    effort.sweeps += answer.sweeps;
    if (!answer.converged) {
      why_not_ = fmt::format("the contact laws are met to {:.2g} of the largest pressure only, with {} candidates",
                             answer.residual, vertices.size());
      return std::nullopt;
    }
    if (c == 1) widen(answer, block_.compliance());
    relax(answer);

    now.grew = false;
    if (!take_shift(answer, gap, target, now)) return std::nullopt;
    follow_patch(answer, now);
    for (std::size_t k = 0; k < vertices.size(); ++k) {
      if (answer.state[k] == NodeState::open) continue;
      for (const int u : surface_.around[vertices[k]]) {
        if (block_.place(u) < 0 && std::isfinite(gap.weighted[u])) {
          now.required[u] = 1;
          now.grew = true;
        }
      }
    }
    const double allowed = now.updates < kStrictUpdates ? lookup_mm_ : 100.0 * lookup_mm_;
    if (!now.grew && std::max(now.lookup_error, now.edge_change) <= allowed) {
      if (auto next = accept(answer, from, now, effort)) return next;
    }
    for (int v = 0; v < n; ++v) now.lookup[v] += now.relaxation * now.last_residual[v];
    wanted.assign(n, 0);
    for (const int v : vertices) {
      wanted[v] = 1;
      for (const int u : surface_.around[v]) wanted[u] = 1;
    }
  }
  why_not_ = fmt::format("the contact patch still moves by {:.2g} mm after {} updates of the geometry",
                         std::max(now.lookup_error, now.edge_change), kMostUpdates);
  return std::nullopt;
}

}  // namespace touchstone::fem
