#include "fem/contact/press_part.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "core/error.h"
#include "fem/contact/cut_compliance.h"
#include "fem/contact/press_part_iterate.h"

namespace touchstone::fem {
namespace {

constexpr int kMostUpdates = 60;
constexpr int kStrictUpdates = 8;    // after these the lookup may be a hundred times further off
constexpr int kPlainUpdates = 5;     // after these the fixed point is relaxed
constexpr double kHoldFades = 0.25;  // an update, after the first few
constexpr int kHeldUpdates = 2;
constexpr double kLargestTurn = 0.1;     // radians an update, under torque control
constexpr double kJustTouching = 1e-12;  // of the thickness: an overlap of rounding is none

/// Turns an answer without friction into one with three components a vertex.
void widen(ContactAnswer& answer, const Eigen::Ref<const Eigen::MatrixXd>& compliance) {
  const Eigen::VectorXd p = answer.z;
  answer.z = Eigen::VectorXd::Zero(3 * p.size());
  answer.response = Eigen::VectorXd::Zero(3 * p.size());
  for (Eigen::Index j = 0; j < p.size(); ++j) {
    answer.z[3 * j] = p[j];
    if (p[j] != 0.0) answer.response += p[j] * compliance.col(3 * j);
  }
}

/// Why a contact problem of so many candidates has no answer.
std::string no_answer(const ContactAnswer& answer, std::size_t candidates) {
  if (!std::isfinite(answer.residual)) {
    return fmt::format("the contact laws have no answer with {} candidates: their system isn't positive definite",
                       candidates);
  }
  if (answer.residual == 0.0) return fmt::format("none of {} candidates can carry the wanted force", candidates);
  return fmt::format("the contact laws are met to {:.2g} of the largest pressure only, with {} candidates",
                     answer.residual, candidates);
}

}  // namespace

Eigen::Matrix3d turned_by(const Eigen::Vector3d& turn) {
  const double angle = turn.norm();
  if (angle == 0.0) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix();
}

PartSolver::PartSolver(const Compliance& gel, std::vector<PressBody> bodies, double lookup_mm, double traction,
                       bool outlines, PronySeries relaxation)
    : gel_(gel),
      bodies_(std::move(bodies)),
      lookup_mm_(lookup_mm),
      traction_(traction),
      outlines_(outlines),
      relaxation_(std::move(relaxation)),
      mu_(bodies_.size(), 0.0),
      surface_(gel),
      block_(gel, surface_),
      remembered_axes_(bodies_.size()),
      cached_gaps_(bodies_.size()) {
  size_ = std::accumulate(surface_.triangle_size.begin(), surface_.triangle_size.end(), 0.0) /
          static_cast<double>(surface_.triangle_size.size());
  for (const PressBody& body : bodies_) {
    soft_.push_back(body.elastic ? std::make_unique<ElasticBody>(*body.elastic) : nullptr);
    elastic_ = elastic_ || body.elastic;
  }
}

PartSolver::~PartSolver() = default;

void PartSolver::set_friction(const std::vector<double>& friction) {
  if (friction != mu_) memory_.forget();
  mu_ = friction;
  friction_ = std::any_of(mu_.begin(), mu_.end(), [](double mu) { return mu > 0.0; });
}

void PartSolver::refuse_too_deep(double deepest) const {
  if (-deepest > gel_.thickness) {
    fail("the object reaches {:.4g} mm into a gel of {:.4g} mm", -deepest, gel_.thickness);
  }
}

/// Weighted tangential displacement, in the vertices' own axes, that the gel would have at the block's vertices if it
/// had gone along with the body since `from`.
Eigen::VectorXd PartSolver::drag(const PressSnapshot& from, const Iterate& now) const {
  const auto& vertices = block_.vertices();
  std::vector<RigidTransform> motion;
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    motion.push_back(now.bodies[b].pose * from.bodies[b].pose.inverse());
  }
  Eigen::VectorXd result(2 * static_cast<Eigen::Index>(vertices.size()));
  for (std::size_t k = 0; k < vertices.size(); ++k) {
    const int v = vertices[k];
    const int b = now.owner[v];
    Eigen::Vector3d weighted = relative_at(from, v);
    if (b >= 0 && now.bodies[b].pose.rotation == from.bodies[b].pose.rotation) {
      weighted += surface_.weight[v] * (now.bodies[b].pose.translation - from.bodies[b].pose.translation);
    } else if (b >= 0) {
      for (Eigen::SparseMatrix<double>::InnerIterator it(gel_.mass, v); it; ++it) {
        const int u = static_cast<int>(it.row());
        const Eigen::Vector3d at = gel_.vertices[u] + weighted_at(from, u) / surface_.weight[u];
        weighted += it.value() * (motion[b] * at - at);
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

/// Begins with the state of `from`; the lookup goes on with a body if most of its contact stuck.
void PartSolver::begin(const PressSnapshot& from, const std::vector<PartTarget>& targets, Iterate& now) const {
  const int n = static_cast<int>(gel_.vertices.size());
  now.active.assign(n, 0);
  now.required.assign(n, 0);
  now.reach = kLeastReach * gel_.thickness;
  now.bodies.resize(bodies_.size());
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    Body& body = now.bodies[b];
    body.pose = targets[b].pose;
    body.turn = from.bodies[b].turn;
    std::vector<int> vertices;
    std::vector<Eigen::Vector3d> displacements;
    std::vector<double> pressures;
    int stuck = 0;
    for (int v = 0; v < n; ++v) {
      if (from.owner[v] != static_cast<int>(b)) continue;
      now.active[v] = 1;
      vertices.push_back(v);
      displacements.push_back(weighted_at(from, v) / surface_.weight[v]);
      pressures.push_back(-surface_.weight[v] * surface_.normals[v].dot(from.traction.segment<3>(3 * v)));
      stuck += from.state[v] == NodeState::stick;
    }
    if (2 * stuck > static_cast<int>(vertices.size())) {
      const RigidTransform motion = body.pose * from.bodies[b].pose.inverse();
      for (std::size_t k = 0; k < vertices.size(); ++k) {
        const Eigen::Vector3d at = gel_.vertices[vertices[k]] + displacements[k];
        displacements[k] += motion * at - at;
      }
    }
    body.lookup = motion_of(vertices, displacements, pressures);
  }
  now.traction = from.traction;
  now.warm = from.touching();
}

ContactProblem PartSolver::problem(const PressSnapshot& from, const std::vector<PartTarget>& targets,
                                   const Iterate& now) {
  const int c = friction_ ? 3 : 1;
  const auto& vertices = block_.vertices();
  const auto m = static_cast<Eigen::Index>(vertices.size());
  ContactProblem result;
  result.components = c;
  std::vector<std::shared_ptr<const CutHats>> cuts;
  bool any_cuts = false;
  for (const Body& body : now.bodies) {
    cuts.push_back(body.gap.cuts);
    any_cuts = any_cuts || body.gap.cuts;
  }
  std::vector<int> owner;
  for (const int v : vertices) owner.push_back(now.owner[v]);
  if (use_combined_ && !elastic_ && cuts == combined_cuts_ && vertices == combined_vertices_ &&
      owner == combined_owner_) {
    // It holds as it is.
  } else if (elastic_ || any_cuts) {
    combined_ = block_.compliance();
    joint_cuts_ = joint_cuts(surface_, cuts, now.owner);
    if (joint_cuts_) {
      add_cut_compliance(combined_, *joint_cuts_, surface_, gel_, vertices, block_.axes(), c == 1 && surface_.flat);
    }
    if (elastic_ && any_cuts) cut_ = combined_;
    any_cuts_ = any_cuts;
    combined_cuts_ = cuts;
    combined_vertices_ = vertices;
    combined_owner_ = owner;
    use_combined_ = true;
    const auto normals = Eigen::seqN(Eigen::fix<0>, m, Eigen::fix<3>);
    const bool normal_only = !friction_ && surface_.flat;  // what a body does along the surface then matters to nobody
    if (normal_only) combined_normal_ = combined_(normals, normals);
    std::vector<Eigen::Matrix3d> axes;
    for (const int v : vertices) axes.push_back(block_.axes(v));
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
      if (!soft_[b]) continue;
      std::vector<char> mine;
      for (const int v : vertices) mine.push_back(now.owner[v] == static_cast<int>(b));
      const Body& body = now.bodies[b];
      if (normal_only) {
        soft_[b]->add_normal_to(combined_normal_, relaxation_.stiffness(), surface_, vertices, mine,
                                surface_.normals.front(), body.pose, body.lookup, body.gap.cuts.get());
      } else {
        soft_[b]->add_to(combined_, relaxation_.stiffness(), surface_, vertices, mine, axes, body.pose, body.lookup,
                         body.gap.cuts.get());
      }
    }
    if (normal_only) {
      combined_(normals, normals) = combined_normal_;
    } else {
      combined_normal_ = combined_(normals, normals);
    }
    memory_.forget();
  } else if (use_combined_) {
    use_combined_ = any_cuts_ = false;
    joint_cuts_.reset();
    memory_.forget();
  }
  for (const PartTarget& target : targets) {
    if (target.turned[0] || target.turned[1] || target.turned[2]) memory_.forget();  // its border changes
  }
  if (c == 3) {
    result.compliance.emplace(compliance());
  } else {
    result.compliance.emplace(use_combined_ ? combined_normal_ : block_.normal_compliance());
  }
  result.gap.resize(m);
  for (Eigen::Index j = 0; j < m; ++j) result.gap[j] = now.gap(vertices[j]);
  if (c == 3) {
    result.friction.resize(m);
    for (Eigen::Index j = 0; j < m; ++j) {
      const int b = now.owner[vertices[j]];
      result.friction[j] = b < 0 ? 0.0 : mu_[b];
    }
    result.drag = drag(from, now);
  }

  Eigen::Index columns = 0;
  for (const PartTarget& target : targets) {
    for (int a = 0; a < 3; ++a) columns += target.forced[a] + target.turned[a];
  }
  result.border = Eigen::MatrixXd::Zero(c * m, columns);
  result.force.resize(columns);
  result.hold = Eigen::VectorXd::Zero(columns);
  Eigen::Index column = 0;
  for (std::size_t b = 0; b < targets.size(); ++b) {
    const PartTarget& target = targets[b];
    for (int a = 0; a < 6; ++a) {
      const bool rotation = a >= 3;
      if (!(rotation ? target.turned[a - 3] : target.forced[a])) continue;
      result.force[column] = rotation ? target.torque[a - 3] : target.force[a];
      if (rotation) {
        // A turn is held back at first, when the contact may be a point or a line that doesn't resist it.
        const double radius = std::max(now.bodies[b].patch_radius, size_);
        result.hold[column] = 8.0 * shear_modulus(gel_.material) * std::pow(radius, 3) *
                              std::pow(kHoldFades, std::max(0, now.updates - kHeldUpdates));
      }
      const Eigen::Vector3d axis = Eigen::Vector3d::Unit(a % 3);
      for (Eigen::Index j = 0; j < m; ++j) {
        const int v = vertices[j];
        if (now.owner[v] != static_cast<int>(b)) continue;
        // int phi (the body's motion) dA.
        Eigen::Vector3d moved = surface_.weight[v] * axis;
        if (rotation) {
          Eigen::Vector3d arm = arm_of(now, v) - surface_.weight[v] * now.bodies[b].pose.translation;
          if (now.weighted.size() == 3 * m) arm += now.weighted.segment<3>(3 * j);
          moved = axis.cross(arm);
        }
        result.border.block(c * j, column, c, 1) = -block_.axes(v).leftCols(c).transpose() * moved;
      }
      ++column;
    }
  }
  return result;
}

/// The place of a vertex's traction times its weight: int phi x dA, or with what bears of its hat.
Eigen::Vector3d PartSolver::arm_of(const Iterate& now, int vertex) const {
  if (now.owner[vertex] >= 0) {
    const auto& cuts = now.bodies[now.owner[vertex]].gap.cuts;
    const Eigen::Index place = cuts ? place_in(*cuts, vertex) : -1;
    if (place >= 0) return cuts->moment.col(place);
  }
  Eigen::Vector3d arm = Eigen::Vector3d::Zero();
  for (Eigen::SparseMatrix<double>::InnerIterator it(gel_.mass, vertex); it; ++it) {
    arm += it.value() * gel_.vertices[static_cast<std::size_t>(it.row())];
  }
  return arm;
}

/// Moves the poses by what forces and torques ask for, no faster than the block can follow. False if a body slides away
/// or turns over.
bool PartSolver::take_shift(const ContactAnswer& answer, const std::vector<PartTarget>& targets, Iterate& now) {
  Eigen::Index next = 0;
  now.edge_change = 0.0;
  const auto& vertices = block_.vertices();
  for (std::size_t b = 0; b < targets.size(); ++b) {
    Body& body = now.bodies[b];
    const PartTarget& target = targets[b];
    Eigen::Vector3d shift = Eigen::Vector3d::Zero();
    Eigen::Vector3d turn = Eigen::Vector3d::Zero();
    for (int a = 0; a < 3; ++a) {
      if (target.forced[a]) shift[a] = answer.shift[next++];
    }
    for (int a = 0; a < 3; ++a) {
      if (target.turned[a]) turn[a] = answer.shift[next++];
    }
    if (!shift.allFinite() || !turn.allFinite() || shift.head<2>().norm() > 4.0 * gel_.thickness) {
      why_not_ = fmt::format("the object slides away by more than {:.3g} mm", 4.0 * gel_.thickness);
      return false;
    }
    const double depth = std::max(0.0, -body.gap.deepest);
    const double limit = std::min(0.98 * gel_.thickness, std::max(4.0 * depth, 0.02 * gel_.thickness));
    if (shift.z() < 0.0 && depth - shift.z() > limit) {
      if (depth > 0.97 * gel_.thickness && ++now.at_the_bottom > 20) {
        fail("the wanted force of {:.4g} N needs the object deeper than the gel's {:.4g} mm", target.force[2],
             gel_.thickness);
      }
      shift.z() = std::min(0.0, depth - limit);
      now.grew = true;  // not an answer yet
    }
    if (turn.squaredNorm() > 0.0) {
      if (turn.norm() > kLargestTurn) {
        turn *= kLargestTurn / turn.norm();
        now.grew = true;
      }
      body.turn += turn;
      if (body.turn.norm() > kMostTurn) {
        why_not_ = fmt::format("the object turns over: torque control has turned it by more than {} rad", kMostTurn);
        return false;
      }
      body.pose.rotation = turned_by(turn) * body.pose.rotation;
      now.edge_change = std::max(now.edge_change, turn.norm() * body.patch_radius);
    }
    body.pose.translation += shift;
    if (shift.squaredNorm() == 0.0) continue;
    if (!surface_.flat || body.gap.overlap_cuts_after(surface_.normals.front().dot(shift))) {
      now.edge_change = std::max(now.edge_change, shift.norm());
    }
    for (std::size_t j = 0; j < vertices.size(); ++j) {
      const int v = vertices[j];
      if (now.owner[v] != static_cast<int>(b) || answer.state[j] == NodeState::open) continue;
      now.edge_change =
          std::max(now.edge_change, body.gap.edge[v] / surface_.weight[v] * std::abs(surface_.normals[v].dot(shift)));
    }
    // What the answer was found for: gaps moved along the normals, but not the edges' part.
    for (Eigen::Index v = 0; v < body.gap.weighted.size(); ++v) {
      if (!std::isfinite(body.gap.weighted[v])) continue;
      body.gap.weighted[v] += surface_.weight[v] * surface_.normals[static_cast<std::size_t>(v)].dot(shift);
    }
    if (surface_.flat) {
      body.gap.deepest += surface_.normals.front().dot(shift);
      body.gap.reach += surface_.normals.front().dot(shift);
    }
    // What sticks goes along.
    const Eigen::Vector3d& normal = body.lookup.normal;
    body.lookup.translation += shift - normal.dot(shift) * normal;
  }
  return true;
}

/// How far the lookups are from the contact patches' mean motions: `lookup_error`, and the residuals for the next ones.
void PartSolver::follow_patches(const ContactAnswer& answer, Iterate& now) const {
  const auto& vertices = block_.vertices();
  const auto m = static_cast<Eigen::Index>(vertices.size());
  std::fill(now.active.begin(), now.active.end(), 0);
  now.traction.setZero();
  // The gel's own response; `answer` holds that of gel and elastic bodies together.
  Eigen::VectorXd own = answer.response;
  if (elastic_) {
    own.setZero();
    const Eigen::Ref<const Eigen::MatrixXd> gel = gel_compliance();
    for (Eigen::Index j = 0; j < answer.z.size(); ++j) {
      if (answer.z[j] != 0.0) own += answer.z[j] * gel.col(j);
    }
    for (Eigen::Index j = 0; j < m; ++j) {
      own.segment<3>(3 * j) -= block_.axes(vertices[j]).transpose() * relaxation_.carried(vertices[j]);
    }
    own /= relaxation_.stiffness();
  }
  now.weighted.resize(3 * m);
  for (Eigen::Index j = 0; j < m; ++j) {
    const int v = vertices[j];
    now.active[v] = answer.state[j] != NodeState::open;
    now.traction.segment<3>(3 * v) = block_.axes(v) * answer.z.segment<3>(3 * j);
    now.weighted.segment<3>(3 * j) = block_.axes(v) * own.segment<3>(3 * j);
  }
  now.warm = true;
  now.lookup_error = 0.0;
  for (std::size_t b = 0; b < now.bodies.size(); ++b) {
    Body& body = now.bodies[b];
    std::vector<int> mine;
    std::vector<Eigen::Vector3d> displacements;
    std::vector<double> pressures;
    for (Eigen::Index j = 0; j < m; ++j) {
      const int v = vertices[j];
      if (!now.active[v] || now.owner[v] != static_cast<int>(b)) continue;
      mine.push_back(v);
      displacements.push_back(now.weighted.segment<3>(3 * j) / surface_.weight[v]);
      pressures.push_back(std::max(0.0, answer.z[3 * j]) * surface_.weight[v]);
    }
    body.touching = !mine.empty();
    if (mine.empty()) continue;
    const PatchMotion patch = motion_of(mine, displacements, pressures);
    body.patch_radius = 0.0;
    for (const int v : mine) body.patch_radius = std::max(body.patch_radius, (gel_.vertices[v] - patch.centre).norm());
    // Both motions about the patch's centre: its translation's two components along the surface, and the spin.
    const Eigen::Vector3d at_centre = body.lookup.displacement(patch.centre);
    const Eigen::Vector3d first = block_.axes(mine.front()).col(1);
    const Eigen::Vector3d second = block_.axes(mine.front()).col(2);
    const Eigen::Vector3d missing = patch.translation - at_centre;
    const std::array<double, 3> residual = {first.dot(missing), second.dot(missing), patch.spin - body.lookup.spin};
    now.lookup_error =
        std::max(now.lookup_error, std::hypot(residual[0], residual[1]) + std::abs(residual[2]) * body.patch_radius);
    const std::array<double, 3> scale = {1.0, 1.0, body.patch_radius};
    // Aitken's rule for vectors [Irons1969] where the plain fixed point is slow.
    if (now.updates > kPlainUpdates && body.has_residual) {
      double cross = 0.0;
      double square = 0.0;
      for (int k = 0; k < 3; ++k) {
        const double difference = scale[k] * (residual[k] - body.last_residual[k]);
        cross += scale[k] * body.last_residual[k] * difference;
        square += difference * difference;
      }
      if (square > 0.0) body.relaxation = std::clamp(-body.relaxation * cross / square, 0.1, 1.0);
    }
    body.last_residual = residual;
    body.has_residual = true;
    PatchMotion next = patch;
    next.translation = at_centre + body.relaxation * (residual[0] * first + residual[1] * second);
    next.translation -= next.normal.dot(next.translation) * next.normal;
    next.spin = body.lookup.spin + body.relaxation * residual[2];
    body.next_lookup = next;
  }
}

std::optional<PressSnapshot> PartSolver::solve(const PressSnapshot& from, const std::vector<PartTarget>& targets,
                                               double seconds, PartEffort& effort) {
  const int n = static_cast<int>(gel_.vertices.size());
  TS_ASSERT(targets.size() == bodies_.size() && from.bodies.size() == bodies_.size());
  bool z_forced = false;
  for (std::size_t b = 0; b < targets.size(); ++b) {
    std::array<bool, 6> axes{};
    std::copy(targets[b].forced.begin(), targets[b].forced.end(), axes.begin());
    std::copy(targets[b].turned.begin(), targets[b].turned.end(), axes.begin() + 3);
    if (axes != remembered_axes_[b]) memory_.forget();
    remembered_axes_[b] = axes;
    z_forced = z_forced || targets[b].forced[2];
  }
  Iterate now;
  begin(from, targets, now);
  relaxation_.begin(from.history, seconds, n);
  const auto out_of_contact = [&] {
    std::vector<BodySnapshot> bodies(now.bodies.size());
    for (std::size_t b = 0; b < bodies.size(); ++b) {
      bodies[b].pose = now.bodies[b].pose;
      bodies[b].turn = now.bodies[b].turn;
    }
    return apart(from, std::move(bodies), seconds);
  };
  for (now.updates = 0; now.updates < kMostUpdates; ++now.updates) {
    look_up(now, targets, effort);
    const bool alone = std::none_of(now.active.begin(), now.active.end(), [](char x) { return x != 0; });
    if (!z_forced && alone && now.deepest >= -kJustTouching * gel_.thickness && !bulges_into(now))
      return out_of_contact();
    for (int v = 0; v < n; ++v) {
      if (now.owner[v] < 0) now.active[v] = now.required[v] = 0;
    }
    if (block_.hold(candidates(now, z_forced))) {
      memory_.forget();
      now.weighted.resize(0);
    }
    const auto& vertices = block_.vertices();
    if (vertices.empty()) return out_of_contact();

    ContactProblem contact = problem(from, targets, now);
    relaxation_.prepare(contact, block_);
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
      why_not_ = no_answer(answer, vertices.size());
      return std::nullopt;
    }
    if (c == 1) widen(answer, compliance());
    relaxation_.finish(answer, block_);

    now.grew = false;
    if (!take_shift(answer, targets, now)) return std::nullopt;
    follow_patches(answer, now);
    for (std::size_t k = 0; k < vertices.size(); ++k) {
      if (answer.state[k] == NodeState::open) continue;
      for (const int u : surface_.around[vertices[k]]) {
        if (block_.place(u) < 0 && now.owner[u] >= 0) {
          now.required[u] = 1;
          now.grew = true;
        }
      }
    }
    const double allowed = now.updates < kStrictUpdates ? lookup_mm_ : 100.0 * lookup_mm_;
    if (!now.grew && std::max(now.lookup_error, now.edge_change) <= allowed) {
      if (auto next = accept(answer, from, now, effort)) return next;
    }
    for (Body& body : now.bodies) {
      if (body.touching) body.lookup = body.next_lookup;
    }
  }
  why_not_ = fmt::format("the contact patch still moves by {:.2g} mm after {} updates of the geometry",
                         std::max(now.lookup_error, now.edge_change), kMostUpdates);
  return std::nullopt;
}

}  // namespace touchstone::fem
