// What is kept of a part that is solved, and of one in which nothing touches.

#include <algorithm>
#include <utility>

#include "fem/contact/press_part_iterate.h"

namespace touchstone::fem {

bool PressSnapshot::touching() const {
  return std::any_of(bodies.begin(), bodies.end(), [](const BodySnapshot& body) { return body.touching; });
}

void PressSnapshot::forget(int body) {
  bool any = false;
  for (std::size_t v = 0; v < state.size(); ++v) {
    if (owner[v] != body) continue;
    any = true;
    state[v] = NodeState::open;
    owner[v] = -1;
    traction.segment<3>(static_cast<Eigen::Index>(3 * v)).setZero();
  }
  // An elastic gel is at once what the other bodies make of it; a relaxing one still has its dent.
  if (any && history.empty()) known.assign(known.size(), 0);
  bodies[body].force.setZero();
  bodies[body].moment.setZero();
  bodies[body].touching = bodies[body].overlapping = false;
}

PressSnapshot untouched(std::vector<BodySnapshot> bodies, int n) {
  PressSnapshot s;
  s.bodies = std::move(bodies);
  for (BodySnapshot& body : s.bodies) {
    body.force.setZero();
    body.moment.setZero();
    body.touching = body.overlapping = false;
  }
  s.traction = Eigen::VectorXd::Zero(3 * n);
  s.share = Eigen::VectorXd::Ones(n);
  s.weighted = Eigen::VectorXd::Zero(3 * n);
  s.relative = Eigen::VectorXd::Zero(3 * n);
  s.known.assign(n, 1);
  s.state.assign(n, NodeState::open);
  s.owner.assign(n, -1);
  return s;
}

/// The answer as a snapshot; nothing if a vertex outside the block may penetrate, which is then required, or if the gel
/// rises higher than was searched.
std::optional<PressSnapshot> PartSolver::accept(const ContactAnswer& answer, const PressSnapshot& from, Iterate& now,
                                                PartEffort& effort) {
  const int n = static_cast<int>(gel_.vertices.size());
  const auto& vertices = block_.vertices();
  std::vector<BodySnapshot> bodies(now.bodies.size());
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    bodies[b].pose = now.bodies[b].pose;
    bodies[b].turn = now.bodies[b].turn;
  }
  PressSnapshot next = untouched(std::move(bodies), n);
  next.known.assign(n, 0);
  next.cuts = joint_cuts_;
  for (std::size_t b = 0; b < now.bodies.size(); ++b) {
    next.bodies[b].overlapping = now.bodies[b].gap.deepest < 0.0;
    refuse_too_deep(now.bodies[b].gap.deepest);
  }
  double deepest = 0.0;
  double highest = 0.0;
  for (std::size_t k = 0; k < vertices.size(); ++k) {
    const auto j = static_cast<Eigen::Index>(k);
    const int v = vertices[k];
    next.known[v] = 1;
    next.weighted.segment<3>(3 * v) = now.weighted.segment<3>(3 * j);
    next.relative.segment<3>(3 * v) = block_.axes(v) * answer.response.segment<3>(3 * j);
    const double g = now.gap(v) + answer.response[3 * j];
    if (std::isfinite(g)) deepest = std::max(deepest, -g / surface_.weight[v]);
    highest = std::max(highest, surface_.normals[v].dot(now.weighted.segment<3>(3 * j)) / surface_.weight[v]);
    if (answer.state[k] == NodeState::open) continue;
    BodySnapshot& body = next.bodies[now.owner[v]];
    next.state[v] = answer.state[k];
    next.owner[v] = now.owner[v];
    const Eigen::Vector3d traction = now.traction.segment<3>(3 * v);
    next.traction.segment<3>(3 * v) = traction;
    body.force -= surface_.weight[v] * traction;
    // int phi (x + u) dA, exactly.
    const Eigen::Vector3d arm = arm_of(now, v) + now.weighted.segment<3>(3 * j);
    body.moment -= arm.cross(traction);
    const auto& cuts = now.bodies[now.owner[v]].gap.cuts;
    const Eigen::Index cut = cuts ? place_in(*cuts, v) : -1;
    if (cut >= 0) next.share[v] = cuts->share[cut];
    body.touching = true;
  }
  remember(from, next);
  for (const Body& body : now.bodies) {
    const double searched = body.gap.reach - std::max(0.0, body.gap.deepest);
    if (highest > searched) {
      now.reach = 2.0 * highest;
      now.grew = true;
    }
  }
  // Vertices beside the block that a body nearly reaches.
  for (int v = 0; v < n; ++v) {
    if (now.owner[v] < 0 || block_.place(v) >= 0) continue;
    const double gap = now.gap(v) / surface_.weight[v];
    if (gap > highest) continue;
    const double g = gap - surface_.normals[v].dot(weighted_at(next, v)) / surface_.weight[v];
    if (-g > lookup_mm_) {
      now.required[v] = 1;
      now.grew = true;
    }
    deepest = std::max(deepest, -g);
  }
  if (now.grew) return std::nullopt;
  if (relaxation_.on()) {  // the face isn't flat: a body may hang in the dent of an earlier press
    for (BodySnapshot& body : next.bodies) body.overlapping = false;
    for (int v = 0; v < n; ++v) {
      if (now.owner[v] < 0) continue;
      const double risen = surface_.normals[v].dot(next.weighted.segment<3>(3 * v)) / surface_.weight[v];
      if (now.bodies[now.owner[v]].gap.lowest[v] < risen) next.bodies[now.owner[v]].overlapping = true;
    }
  }
  next.penetration = deepest;
  next.lookup_error = now.lookup_error;
  next.residual = answer.residual;
  effort.candidates = std::max(effort.candidates, static_cast<int>(vertices.size()));
  return next;
}

/// With relaxation: what the gel remembers, and its displacement all over, by the one pass over the whole compliance.
void PartSolver::remember(const PressSnapshot& from, PressSnapshot& next) const {
  if (!relaxation_.on() || (from.history.empty() && !next.touching())) return;
  const auto n = static_cast<Eigen::Index>(gel_.vertices.size());
  Eigen::VectorXd elastic = Eigen::VectorXd::Zero(3 * n);
  for (Eigen::Index v = 0; v < n; ++v) {
    if (next.state[static_cast<std::size_t>(v)] == NodeState::open) continue;
    elastic.noalias() += gel_.surface.view().middleCols<3>(3 * v) * next.traction.segment<3>(3 * v);
  }
  // What bears of a cut hat gives way otherwise than the whole of it.
  const Eigen::Ref<const Eigen::MatrixXd> cut = gel_compliance();
  for (std::size_t k = 0; next.touching() && any_cuts_ && k < block_.vertices().size(); ++k) {
    const int v = block_.vertices()[k];
    Eigen::Vector3d own = Eigen::Vector3d::Zero();
    const auto rows = cut.middleCols<3>(3 * static_cast<Eigen::Index>(k));  // symmetric
    for (std::size_t l = 0; l < block_.vertices().size(); ++l) {
      const int u = block_.vertices()[l];
      if (next.state[u] == NodeState::open) continue;
      own += rows.middleRows<3>(3 * static_cast<Eigen::Index>(l)).transpose() *
             (block_.axes(u).transpose() * next.traction.segment<3>(3 * u));
    }
    elastic.segment<3>(3 * v) = block_.axes(v) * own;
  }
  next.history = relaxation_.after(from.history, next.traction, elastic);
  next.weighted = next.history.elastic.tail(3 * n);
  for (Eigen::Index v = 0; v < n; ++v) {
    char& known = next.known[static_cast<std::size_t>(v)];
    if (!known) next.relative.segment<3>(3 * v) = next.weighted.segment<3>(3 * v);
    known = 1;
  }
}

PressSnapshot PartSolver::apart(const PressSnapshot& from, std::vector<BodySnapshot> bodies, double seconds) {
  const int n = static_cast<int>(gel_.vertices.size());
  PressSnapshot next = untouched(std::move(bodies), n);
  relaxation_.begin(from.history, seconds, n);
  remember(from, next);
  next.relative = next.weighted;
  return next;
}

}  // namespace touchstone::fem
