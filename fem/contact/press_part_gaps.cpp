// Where the bodies are over the gel, and which vertices may touch.

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/error.h"
#include "fem/contact/press_part_iterate.h"

namespace touchstone::fem {
namespace {

constexpr double kSurelyTouching = 0.3;  // of the deepest overlap: vertices that overlap by more start in the block
constexpr std::size_t kFirstCandidates = 12;
// The gel bulges beside a contact by less than this part of the depth; vertices further from a body than that, and a
// little, aren't looked at. It is checked at the answer, and widened where it doesn't hold.
constexpr double kBulge = 0.5;
constexpr double kCutsHold = 0.005;  // of a triangle, or of the depth: a body moved by less cuts hats as it did
constexpr double kCutsHoldLate = 0.5;
constexpr double kNoOverlapYet = 0.5;   // of the depth, by which it may change where the overlap doesn't cut
constexpr int kCutUpdates = 12;         // after these the latter holds: what goes to and fro comes to rest
constexpr double kOwnersAlike = 0.05;   // of a triangle: bodies whose gaps at a vertex differ by less are equally near
constexpr double kSharpestCurve = 0.3;  // of a triangle: radius down to which a gap counts as smooth
constexpr double kSlopeStep = 3e-4;     // of a triangle

}  // namespace

Eigen::Vector3d PartSolver::weighted_at(const PressSnapshot& snapshot, int vertex) const {
  if (snapshot.known[vertex]) return snapshot.weighted.segment<3>(3 * vertex);
  std::vector<int> bearing;
  for (std::size_t v = 0; v < snapshot.state.size(); ++v) {
    if (snapshot.state[v] != NodeState::open) bearing.push_back(static_cast<int>(v));
  }
  const Eigen::MatrixXd rows = gel_.surface.block(bearing, std::array{vertex});  // symmetric
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < bearing.size(); ++k) {
    sum +=
        rows.middleRows<3>(3 * static_cast<Eigen::Index>(k)).transpose() * snapshot.traction.segment<3>(3 * bearing[k]);
  }
  return sum;
}

/// Of the gel relative to the body that touches it; an open vertex has no history against a body.
Eigen::Vector3d PartSolver::relative_at(const PressSnapshot& snapshot, int vertex) const {
  return snapshot.known[vertex] ? Eigen::Vector3d(snapshot.relative.segment<3>(3 * vertex))
                                : weighted_at(snapshot, vertex);
}

/// Whether the body has moved by no more than this part of a triangle, and of the depth where the overlap cuts, since
/// the hats were cut. Where it doesn't, half the depth is allowed.
bool PartSolver::cuts_hold(const CachedGap& cached, const Body& body, double part) const {
  for (const int v : cached.gap.cuts->vertices) {
    const Eigen::Vector3d& x = surface_.vertices[v];
    const Eigen::Vector3d& normal = surface_.normals[v];
    // Where what is now over the point was then.
    const Eigen::Vector3d then = cached.cut_pose * (body.pose.inverse() * (x + body.lookup.displacement(x)));
    const Eigen::Vector3d moved = then - x - cached.cut_lookup.displacement(x);
    const double away = normal.dot(moved);
    if ((moved - away * normal).norm() > part * size_) return false;
    // Cut where the body hardly touched, hats don't know yet what the overlap will cut.
    const double most =
        cached.gap.cuts->by_overlap ? part * cached.cut_depth : part * size_ + kNoOverlapYet * cached.cut_depth;
    if (std::abs(away) > most) return false;
  }
  return true;
}

/// The gap of one body at its pose, looked up or carried over from a place nearby.
WeightedGap PartSolver::gap_of(std::size_t b, const Iterate& now, PartEffort& effort) {
  const Body& body = now.bodies[b];
  CachedGap& cached = cached_gaps_[b];
  const ContactShape& shape = bodies_[b].shape;
  // Some more than what is asked for, so that it serves the next, deeper place, too.
  const GapReach reach = surface_.flat ? GapReach{now.reach + kLeastReach * gel_.thickness, 1.5 * kBulge} : GapReach{};
  const auto keeps_cuts = [&] {
    return cached.gap.cuts && cuts_hold(cached, body, now.updates < kCutUpdates ? kCutsHold : kCutsHoldLate);
  };
  const auto evaluate = [&] {
    const bool kept = keeps_cuts();
    std::vector<std::array<double, 2>> bent = std::move(cached.gap.bent);
    const double away = surface_.normals.front().dot(body.pose.translation - cached.pose.translation);
    cached.gap =
        weighted_gap(surface_, shape, body.pose, body.lookup, reach, outlines_, kept ? cached.gap.cuts : nullptr);
    if (kept) {  // not asked for again
      cached.gap.bent = std::move(bent);
      for (auto& range : cached.gap.bent) range = {range[0] + away, range[1] + away};
    }
    if (!kept) {
      cached.cut_pose = body.pose;
      cached.cut_lookup = body.lookup;
      cached.cut_depth = std::max(0.0, -cached.gap.deepest);
    }
    cached.pose = body.pose;
    cached.lookup = body.lookup;
    cached.valid = surface_.flat && surface_.normals.front() == Eigen::Vector3d::UnitZ();
    cached.has_slopes = false;
    ++effort.geometry_updates;
    return cached.gap;
  };
  if (!cached.valid || cached.pose.rotation != body.pose.rotation) return evaluate();
  const Eigen::Vector3d motion = body.pose.translation - cached.pose.translation;
  if (motion.z() != 0.0 && cached.gap.overlap_cuts_after(motion.z()) && !keeps_cuts()) return evaluate();
  const auto n = static_cast<Eigen::Index>(gel_.vertices.size());
  Eigen::MatrixX2d slid = Eigen::MatrixX2d::Zero(n, 2);  // of the gel under the body
  for (Eigen::Index v = 0; v < n; ++v) {
    if (!std::isfinite(cached.gap.weighted[v])) continue;
    const Eigen::Vector3d& x = gel_.vertices[static_cast<std::size_t>(v)];
    slid.row(v) = (body.lookup.displacement(x) - cached.lookup.displacement(x) - motion).head<2>().transpose();
  }
  const double farthest = std::sqrt(slid.rowwise().squaredNorm().maxCoeff());
  if (farthest > std::sqrt(lookup_mm_ * kSharpestCurve * size_)) return evaluate();
  // Slopes take two evaluations, and are lost as soon as hats are cut anew.
  if (farthest > lookup_mm_ && cached.gap.cuts) return evaluate();
  WeightedGap gap = cached.gap;
  if (farthest > lookup_mm_) {  // nearer than the lookup is known it makes no difference
    if (!cached.has_slopes) {
      cached.plain_slope = cached.edge_slope = Eigen::MatrixX2d::Zero(n, 2);
      const double step = kSlopeStep * size_;
      for (int axis = 0; axis < 2; ++axis) {
        RigidTransform beside = cached.pose;
        beside.translation[axis] -= step;
        const WeightedGap there =
            weighted_gap(surface_, shape, beside, cached.lookup, reach, outlines_, cached.gap.cuts);
        ++effort.geometry_updates;
        for (Eigen::Index v = 0; v < n; ++v) {
          if (!std::isfinite(gap.weighted[v]) || !std::isfinite(there.weighted[v])) continue;
          cached.plain_slope(v, axis) = (there.plain[v] - gap.plain[v]) / step;
          cached.edge_slope(v, axis) = (there.edge[v] - gap.edge[v]) / step;
        }
      }
      cached.has_slopes = true;
    }
    for (Eigen::Index v = 0; v < n; ++v) {
      if (!std::isfinite(gap.weighted[v])) continue;
      gap.plain[v] += cached.plain_slope.row(v).dot(slid.row(v));
      gap.edge[v] = std::max(0.0, gap.edge[v] + cached.edge_slope.row(v).dot(slid.row(v)));
    }
  }
  gap.move_along_normals(surface_.weight, motion.z());
  const double depth = std::max(0.0, -gap.deepest);
  if (gap.reach < std::max(0.0, gap.deepest) + now.reach + kBulge * depth) return evaluate();
  return gap;
}

/// The gaps of all bodies, and which body each vertex faces.
void PartSolver::look_up(Iterate& now, const std::vector<PartTarget>& targets, PartEffort& effort) {
  const int n = static_cast<int>(gel_.vertices.size());
  const std::vector<int> before = std::move(now.owner);
  now.owner.assign(n, -1);
  now.deepest = std::numeric_limits<double>::infinity();
  for (std::size_t b = 0; b < now.bodies.size(); ++b) {
    Body& body = now.bodies[b];
    body.gap = gap_of(b, now, effort);
    if (!targets[b].forced[2]) {
      refuse_too_deep(body.gap.deepest);
    } else if (!std::isfinite(body.gap.deepest)) {
      fail("the object isn't over the gel: a force of {:.4g} N can't be reached", targets[b].force[2]);
    }
    now.deepest = std::min(now.deepest, body.gap.deepest);
    for (int v = 0; v < n; ++v) {
      if (body.gap.weighted[v] < now.gap(v)) now.owner[v] = static_cast<int>(b);
    }
  }
  // Between two bodies a vertex may go to and fro; it comes to rest at the one that it had.
  for (int v = 0; v < n && now.updates >= kCutUpdates && now.bodies.size() > 1; ++v) {
    if (now.owner[v] < 0 || before[v] < 0) continue;
    const double had = now.bodies[before[v]].gap.weighted[v];
    if (had - now.gap(v) < kOwnersAlike * size_ * surface_.weight[v]) now.owner[v] = before[v];
  }
}

/// Vertices that surely or probably touch, with a ring around them.
std::vector<int> PartSolver::candidates(const Iterate& now, bool z_forced) const {
  const int n = static_cast<int>(gel_.vertices.size());
  std::vector<std::pair<double, int>> near;
  std::size_t touching = 0;
  for (int v = 0; v < n; ++v) {
    touching += now.active[v] != 0;
    if (now.owner[v] >= 0) near.emplace_back(now.gap(v) / surface_.weight[v], v);
  }
  std::sort(near.begin(), near.end());
  std::size_t count = 0;
  while (count < near.size()) {
    const double depth = std::max(0.0, -now.bodies[now.owner[near[count].second]].gap.deepest);
    if (near[count].first >= -kSurelyTouching * depth) break;
    ++count;
  }
  // While the depth is itself being sought it may be far off; the block grows by a factor at a time.
  if (z_forced) count = std::min(count, 4 * touching + kFirstCandidates);
  count = std::max(count, std::min(near.size(), kFirstCandidates));
  std::vector<char> chosen(now.active);
  for (int v = 0; v < n; ++v) chosen[v] = chosen[v] || now.required[v];
  // Each body has its own first ones: under a flat body there are enough to leave none to another that is led by force.
  std::vector<std::size_t> seen(bodies_.size(), 0);
  for (std::size_t k = 0; k < near.size(); ++k) {
    const std::size_t place = seen[now.owner[near[k].second]]++;
    if (k < count || place < kFirstCandidates) chosen[near[k].second] = 1;
  }
  const auto is_beside = [&](int v, const std::vector<char>& marked) {
    return std::any_of(surface_.around[v].begin(), surface_.around[v].end(), [&](int u) { return marked[u] != 0; });
  };
  const auto is_cut = [&](int v) {
    const auto& cuts = now.bodies[now.owner[v]].gap.cuts;
    return cuts && place_in(*cuts, v) >= 0;
  };
  std::vector<char> taken(chosen.size());
  for (int v = 0; v < n; ++v) taken[v] = now.owner[v] >= 0 && (chosen[v] || is_beside(v, chosen));
  // A sliver of a body overlaps at what is left of a hat: without its own part in the compliance that looks like
  // penetration at the answer, which would then be sought again with it. On a curved gel more of them can make a system
  // that isn't positive definite.
  std::vector<int> result;
  for (int v = 0; v < n; ++v) {
    const bool sliver =
        surface_.flat && !taken[v] && now.owner[v] >= 0 && now.gap(v) < 0.0 && is_cut(v) && is_beside(v, taken);
    if (taken[v] || sliver) result.push_back(v);
  }
  return result;
}

/// Whether the gel, not yet recovered from an earlier press, would stand out into a body if nothing touched it.
bool PartSolver::bulges_into(const Iterate& now) const {
  if (!relaxation_.on()) return false;
  for (int v = 0; v < static_cast<int>(gel_.vertices.size()); ++v) {
    const double out = -surface_.normals[v].dot(relaxation_.carried(v)) / relaxation_.stiffness();
    if (now.gap(v) < out) return true;
  }
  return false;
}

}  // namespace touchstone::fem
