#include "fem/press.h"

#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "core/error.h"
#include "fem/contact_block.h"
#include "fem/contact_gap.h"
#include "fem/surface_strain.h"

namespace touchstone::fem {
namespace {

constexpr int kMostGeometryUpdates = 80;
constexpr int kUndampedUpdates = 12;
constexpr double kSurelyTouching = 0.3;  // of the deepest overlap: vertices that overlap by more start in the block
constexpr int kResolvedVertices = 13;

using Kind = AxisControl::Kind;

/// A converged point of the path.
struct Snapshot {
  RigidTransform pose;
  Eigen::VectorXd traction;  ///< 3 n, gel frame
  Eigen::VectorXd weighted;  ///< 3 n, int phi u dA
  std::vector<NodeState> state;
  Eigen::Vector3d force = Eigen::Vector3d::Zero();  ///< on the object
  bool touching = false;
};

struct Effort {
  int geometry_updates = 0, solves = 0, factorisations = 0, sweeps = 0, parts = 0, candidates = 0;
  double contact_residual = 0.0;
  double penetration = 0.0;
};

RigidTransform between(const RigidTransform& a, const RigidTransform& b, double fraction) {
  if (fraction >= 1.0) return b;
  RigidTransform result;
  result.translation = a.translation + fraction * (b.translation - a.translation);
  result.rotation = a.rotation;
  if (a.rotation != b.rotation) {
    result.rotation =
        Eigen::Quaterniond(a.rotation).slerp(fraction, Eigen::Quaterniond(b.rotation)).toRotationMatrix();
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

}  // namespace

struct Press::Parts {
  Parts(const Compliance& compliance, ContactShape body, double mu, PressTolerance wanted)
      : gel(compliance),
        shape(std::move(body)),
        friction(mu),
        tolerance(wanted),
        surface(gel),
        block(gel, surface, mu > 0.0 ? 3 : 1),
        n(static_cast<int>(gel.vertices.size())) {
    mass.compute(gel.mass);
    if (mass.info() != Eigen::Success) fail("the gel's surface mass matrix isn't positive definite");
    now = untouched({});
    publish({}, {});
  }

  const Compliance& gel;
  ContactShape shape;
  double friction;
  PressTolerance tolerance;
  ContactSurface surface;
  ContactBlock block;
  int n;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> mass;
  Snapshot now;
  bool placed = false;
  PressState state;
  std::string why_not;

  Snapshot untouched(const RigidTransform& pose) const {
    Snapshot s;
    s.pose = pose;
    s.traction = Eigen::VectorXd::Zero(3 * n);
    s.weighted = Eigen::VectorXd::Zero(3 * n);
    s.state.assign(n, NodeState::open);
    return s;
  }

  double deepest_at(const RigidTransform& pose) const { return weighted_gap(surface, shape, pose, {}).deepest; }

  /// The pose straight above `pose` in which the body just touches the undeformed gel; nothing if it isn't over it.
  std::optional<RigidTransform> straight_above(RigidTransform pose) const {
    for (int k = 0; k < 30; ++k) {
      const double gap = deepest_at(pose);
      if (!std::isfinite(gap)) return std::nullopt;
      pose.translation.z() -= gap;
      if (std::abs(gap) < 1e-13 * (1.0 + gel.thickness)) break;
    }
    return pose;
  }

  void refuse_too_deep(double deepest) const {
    if (-deepest > gel.thickness) {
      fail("the object reaches {:.4g} mm into a gel of {:.4g} mm", -deepest, gel.thickness);
    }
  }

  Eigen::Vector3d lumped(const Eigen::VectorXd& weighted, int v) const {
    return weighted.segment<3>(3 * v) / surface.weight[v];
  }

  std::optional<Snapshot> solve_part(const Snapshot& from, const RigidTransform& to, const std::array<bool, 3>& forced,
                                     const Eigen::Vector3d& force, Effort& effort);
  std::optional<Snapshot> advance(const Snapshot& from, const PressTarget& target, const RigidTransform& to,
                                  double begin, double end, const Snapshot& start, int halvings, Effort& effort);
  void publish(const Effort& effort, const std::array<bool, 3>& forced, const Eigen::Vector3d& wanted = {0, 0, 0});
  const PressState& step(const PressTarget& target);

 private:
  std::vector<int> first_candidates(const WeightedGap& gap, const std::vector<char>& active, bool z_forced) const;
  Eigen::VectorXd drag(const Snapshot& from, const RigidTransform& pose) const;
};

/// Vertices that surely or probably touch, with a ring around them.
std::vector<int> Press::Parts::first_candidates(const WeightedGap& gap, const std::vector<char>& active,
                                                bool z_forced) const {
  std::vector<std::pair<double, int>> near;
  int touching = 0;
  for (int v = 0; v < n; ++v) {
    touching += active[v];
    if (std::isfinite(gap.weighted[v])) near.emplace_back(gap.weighted[v] / surface.weight[v], v);
  }
  std::sort(near.begin(), near.end());
  const double depth = std::max(0.0, -gap.deepest);
  std::size_t count = 0;
  while (count < near.size() && near[count].first < -kSurelyTouching * depth) ++count;
  // While the depth is itself being sought it may be far off; the block grows by a factor at a time.
  if (z_forced) count = std::min(count, static_cast<std::size_t>(4 * touching + 12));
  count = std::max(count, std::min<std::size_t>(near.size(), 12));
  std::vector<char> chosen(active);
  for (std::size_t k = 0; k < count; ++k) chosen[near[k].second] = 1;
  std::vector<int> result;
  for (int v = 0; v < n; ++v) {
    if (!std::isfinite(gap.weighted[v])) continue;
    const bool beside = std::any_of(surface.around[v].begin(), surface.around[v].end(),
                                    [&](int neighbour) { return chosen[neighbour] != 0; });
    if (chosen[v] || beside) result.push_back(v);
  }
  return result;
}

/// Weighted tangential displacement, in the vertices' own axes, that the gel would have at the block's vertices if it
/// had gone along with the object since `from`.
Eigen::VectorXd Press::Parts::drag(const Snapshot& from, const RigidTransform& pose) const {
  const RigidTransform motion = pose * from.pose.inverse();
  const auto& vertices = block.vertices();
  Eigen::VectorXd result(2 * static_cast<Eigen::Index>(vertices.size()));
  const bool translated = motion.rotation.isApprox(Eigen::Matrix3d::Identity(), 0.0);
  const Eigen::Vector3d translation = pose.translation - from.pose.translation;
  for (std::size_t k = 0; k < vertices.size(); ++k) {
    const int v = vertices[k];
    Eigen::Vector3d weighted = from.weighted.segment<3>(3 * v);
    if (translated || pose.rotation == from.pose.rotation) {
      weighted += surface.weight[v] * translation;
    } else {
      for (Eigen::SparseMatrix<double>::InnerIterator it(gel.mass, v); it; ++it) {
        const int u = static_cast<int>(it.row());
        const Eigen::Vector3d at = gel.vertices[u] + lumped(from.weighted, u);
        weighted += it.value() * (motion * at - at);
      }
    }
    result.segment<2>(2 * static_cast<Eigen::Index>(k)) = block.axes(v).rightCols<2>().transpose() * weighted;
  }
  return result;
}

/// One part of the path, solved at its end. Nothing, with `why_not`, if it doesn't converge.
std::optional<Snapshot> Press::Parts::solve_part(const Snapshot& from, const RigidTransform& to,
                                                 const std::array<bool, 3>& forced, const Eigen::Vector3d& force,
                                                 Effort& effort) {
  const int c = block.components();
  std::vector<int> axes;
  for (int a = 0; a < 3; ++a) {
    if (forced[a]) axes.push_back(a);
  }
  const auto k = static_cast<Eigen::Index>(axes.size());
  RigidTransform pose = to;
  std::vector<Eigen::Vector3d> tangential(n);
  const RigidTransform motion = pose * from.pose.inverse();
  for (int v = 0; v < n; ++v) {
    tangential[v] = lumped(from.weighted, v);
    // What stuck will most likely go on with the object.
    if (from.state[v] == NodeState::stick) {
      const Eigen::Vector3d at = gel.vertices[v] + tangential[v];
      tangential[v] += motion * at - at;
    }
  }
  std::vector<char> active(n, 0);
  for (int v = 0; v < n; ++v) active[v] = from.state[v] != NodeState::open;
  std::vector<char> required(n, 0);
  Eigen::VectorXd traction = from.traction;
  bool warm = from.touching;
  bool solved = false;
  int stuck_deep = 0;
  double change = 0.0;
  ContactAnswer answer;
  Eigen::VectorXd predicted;  // the gap that the last answer was found with, moved with its shift
  for (int update = 0; update < kMostGeometryUpdates; ++update) {
    const WeightedGap gap = weighted_gap(surface, shape, pose, tangential);
    ++effort.geometry_updates;
    if (!forced[2]) refuse_too_deep(gap.deepest);
    if (forced[2] && !std::isfinite(gap.deepest)) {
      fail("the object isn't over the gel: a force of {:.4g} N can't be reached", force[2]);
    }

    bool grow = false;
    if (solved) {
      change = 0.0;
      const auto& vertices = block.vertices();
      for (std::size_t j = 0; j < vertices.size(); ++j) {
        const int v = vertices[j];
        const double g = gap.weighted[v] + answer.response[c * static_cast<Eigen::Index>(j)];
        if (answer.state[j] != NodeState::open) {
          change = std::max(change, std::abs(gap.weighted[v] - predicted[static_cast<Eigen::Index>(j)]) /
                                        surface.weight[v]);
        } else {
          change = std::max(change, -g / surface.weight[v]);
        }
        if (answer.state[j] == NodeState::open) continue;
        for (const int u : surface.around[v]) {
          if (block.place(u) < 0 && std::isfinite(gap.weighted[u])) grow = required[u] = 1;
        }
      }
      if (!grow && change <= tolerance.gap_mm) {
        // The one pass over the whole compliance.
        Snapshot next = untouched(pose);
        for (std::size_t j = 0; j < vertices.size(); ++j) {
          if (answer.state[j] == NodeState::open) continue;
          const int v = vertices[j];
          next.state[v] = answer.state[j];
          next.traction.segment<3>(3 * v) =
              block.axes(v).leftCols(c) * answer.z.segment(c * static_cast<Eigen::Index>(j), c);
          next.weighted.noalias() += gel.surface.middleCols<3>(3 * v) * next.traction.segment<3>(3 * v);
          next.force -= surface.weight[v] * next.traction.segment<3>(3 * v);
          next.touching = true;
        }
        double deepest = 0.0;
        for (int v = 0; v < n; ++v) {
          if (!std::isfinite(gap.weighted[v])) continue;
          const double g = (gap.weighted[v] - surface.normals[v].dot(next.weighted.segment<3>(3 * v))) /
                           surface.weight[v];
          deepest = std::max(deepest, -g);
          if (block.place(v) < 0 && -g > tolerance.gap_mm) grow = required[v] = 1;
        }
        if (!grow) {
          if (forced[2]) refuse_too_deep(gap.deepest);
          effort.candidates = std::max(effort.candidates, static_cast<int>(vertices.size()));
          effort.contact_residual = std::max(effort.contact_residual, answer.residual);
          effort.penetration = deepest;
          return next;
        }
      }
    }
    if (!forced[2] && gap.deepest >= 0.0 && std::none_of(active.begin(), active.end(), [](char x) { return x; })) {
      return untouched(pose);
    }

    // The block, and the start in it.
    for (int v = 0; v < n; ++v) active[v] = (active[v] || required[v]) && std::isfinite(gap.weighted[v]);
    block.hold(first_candidates(gap, active, forced[2]));
    const auto& vertices = block.vertices();
    const auto m = static_cast<Eigen::Index>(vertices.size());
    if (m == 0) return untouched(pose);
    ContactProblem problem;
    problem.compliance = &block.compliance();
    problem.components = c;
    problem.friction = friction;
    problem.gap.resize(m);
    problem.border.resize(c * m, k);
    problem.force.resize(k);
    Eigen::VectorXd start(warm ? c * m : 0);
    for (Eigen::Index j = 0; j < m; ++j) {
      const int v = vertices[j];
      const Eigen::Matrix3d& own = block.axes(v);
      problem.gap[j] = gap.weighted[v];
      for (Eigen::Index b = 0; b < k; ++b) {
        problem.border.block(c * j, b, c, 1) = -surface.weight[v] * own.leftCols(c).row(axes[b]).transpose();
      }
      if (warm) start.segment(c * j, c) = own.leftCols(c).transpose() * traction.segment<3>(3 * v);
    }
    for (Eigen::Index b = 0; b < k; ++b) problem.force[b] = force[axes[b]];
    if (c == 3) problem.drag = drag(from, pose);
    answer = c == 1 ? solve_frictionless(problem, start) : solve_frictional(problem, start, tolerance.traction);
    effort.solves += answer.iterations;
    effort.factorisations += answer.factorisations;
    effort.sweeps += answer.sweeps;
    if (!answer.converged) {
      why_not = fmt::format("the contact laws are met to {:.2g} of the largest pressure only, with {} candidates",
                            answer.residual, m);
      return std::nullopt;
    }
    solved = true;
    warm = true;

    // The pose that the forces ask for, no faster than the block can follow.
    Eigen::Vector3d shift = Eigen::Vector3d::Zero();
    for (Eigen::Index b = 0; b < k; ++b) shift[axes[b]] = answer.shift[b];
    if (!shift.allFinite() || shift.head<2>().norm() > 4.0 * gel.thickness) {
      why_not = fmt::format("the object slides away by more than {:.3g} mm", 4.0 * gel.thickness);
      return std::nullopt;
    }
    const double depth = std::max(0.0, -gap.deepest);
    const double limit = std::min(0.98 * gel.thickness, std::max(4.0 * depth, 0.02 * gel.thickness));
    bool held_back = false;
    if (depth - shift.z() > limit && shift.z() < 0.0) {
      held_back = true;
      if (depth > 0.97 * gel.thickness && ++stuck_deep > 20) {
        fail("the wanted force of {:.4g} N needs the object deeper than the gel's {:.4g} mm", force[2], gel.thickness);
      }
      shift.z() = std::min(0.0, depth - limit);
    }
    pose.translation += shift;
    predicted.resize(m);
    std::fill(active.begin(), active.end(), 0);
    traction.setZero();
    for (Eigen::Index j = 0; j < m; ++j) {
      const int v = vertices[j];
      const Eigen::Matrix3d& own = block.axes(v);
      predicted[j] = problem.gap[j] + surface.weight[v] * surface.normals[v].dot(shift);
      active[v] = answer.state[j] != NodeState::open;
      traction.segment<3>(3 * v) = own.leftCols(c) * answer.z.segment(c * j, c);
    }
    if (held_back) predicted.array() += 1.0;  // not an answer yet
    if (c == 3) {
      const double share = update < kUndampedUpdates ? 1.0 : 0.5;
      for (Eigen::Index j = 0; j < m; ++j) {
        const int v = vertices[j];
        const Eigen::Vector3d moved = block.axes(v) * answer.response.segment<3>(3 * j) / surface.weight[v];
        tangential[v] += share * (moved - tangential[v]);
      }
    }
  }
  why_not = fmt::format("the gap still moves by {:.2g} mm after {} updates of the geometry", change,
                        kMostGeometryUpdates);
  return std::nullopt;
}

}  // namespace touchstone::fem
