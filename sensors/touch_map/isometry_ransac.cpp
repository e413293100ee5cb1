#include "sensors/touch_map/isometry_ransac.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

#include "core/random.h"

namespace touchstone::sensors {
namespace {

constexpr int kMostRefits = 10;

/// Inliers of a pose. Where a point is in several near pairs, the nearest of them counts.
class InlierSearch {
 public:
  InlierSearch(std::span<const PointPair> pairs, double inlier_mm) : pairs_(pairs), square_(inlier_mm * inlier_mm) {
    int from = 0, to = 0;
    for (const PointPair& pair : pairs) from = std::max(from, pair.from_id + 1), to = std::max(to, pair.to_id + 1);
    from_taken_.assign(static_cast<std::size_t>(from), 0);
    to_taken_.assign(static_cast<std::size_t>(to), 0);
  }

  const std::vector<int>& of(const PlanarPose& pose) {
    near_.clear();
    const Eigen::Matrix2d rotation = pose.rotation();
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      const double square = (rotation * pairs_[i].from + pose.translation - pairs_[i].to).squaredNorm();
      if (square < square_) near_.emplace_back(square, static_cast<int>(i));
    }
    std::sort(near_.begin(), near_.end());
    ++round_;
    inliers_.clear();
    for (const auto& [square, i] : near_) {
      int& from = from_taken_[static_cast<std::size_t>(pairs_[i].from_id)];
      int& to = to_taken_[static_cast<std::size_t>(pairs_[i].to_id)];
      if (from == round_ || to == round_) continue;
      from = to = round_;
      inliers_.push_back(i);
    }
    return inliers_;
  }

 private:
  std::span<const PointPair> pairs_;
  double square_;
  std::vector<std::pair<double, int>> near_;
  std::vector<int> from_taken_, to_taken_, inliers_;
  int round_ = 0;
};

PlanarPose fitted(std::span<const PointPair> pairs, const std::vector<int>& inliers) {
  std::vector<Eigen::Vector2d> from, to;
  for (const int i : inliers) {
    from.push_back(pairs[i].from);
    to.push_back(pairs[i].to);
  }
  return least_squares_isometry(to, from);
}

/// Samples after which two inliers were met together with the assurance.
double samples_needed(std::size_t inliers, std::size_t pairs, double assurance) {
  const double share = static_cast<double>(inliers) / static_cast<double>(pairs);
  const double miss = 1.0 - share * share;
  if (miss <= 0.0) return 1.0;
  return std::log(1.0 - assurance) / std::log(miss);
}

}  // namespace

bool PoseNeighbourhood::holds(const PlanarPose& other) const {
  return (other * middle - pose * middle).norm() <= distance_mm && std::abs(wrapped(other.angle - pose.angle)) <= angle;
}

std::optional<RansacResult> ransac_isometry(std::span<const PointPair> pairs, const RansacSettings& settings,
                                            std::span<const PoseNeighbourhood> except) {
  const auto excepted = [&](const PlanarPose& pose) {
    return std::any_of(except.begin(), except.end(), [&](const auto& one) { return one.holds(pose); });
  };
  if (pairs.size() < 2) return std::nullopt;
  RandomStream random(settings.seed, pairs.size(), Purpose::kMatchSampling);
  const auto draw = [&, count = static_cast<double>(pairs.size())] {
    return static_cast<std::size_t>(random.uniform() * count);
  };
  InlierSearch search(pairs, settings.inlier_mm);
  RansacResult best;
  double needed = settings.samples;
  for (int sample = 0; sample < settings.samples && sample < needed; ++sample) {
    const PointPair &a = pairs[draw()], &b = pairs[draw()];
    const double from_length = (b.from - a.from).norm(), to_length = (b.to - a.to).norm();
    // Two inliers keep their distance; most wrong samples end here.
    if (from_length < settings.baseline_mm || std::abs(from_length - to_length) > 2.0 * settings.inlier_mm) continue;
    const std::array<Eigen::Vector2d, 2> from = {a.from, b.from}, to = {a.to, b.to};
    const PlanarPose pose = least_squares_isometry(to, from);
    if (excepted(pose)) continue;
    const std::vector<int>& inliers = search.of(pose);
    if (inliers.size() <= best.inliers.size() || inliers.size() < 2) continue;
    best = {pose, inliers};
    needed = samples_needed(best.inliers.size(), pairs.size(), settings.assurance);
  }
  if (best.inliers.size() < 2) return std::nullopt;
  for (int refit = 0; refit < kMostRefits; ++refit) {
    const PlanarPose pose = fitted(pairs, best.inliers);
    if (excepted(pose)) break;
    best.to_from_from = pose;
    const std::vector<int>& inliers = search.of(pose);
    if (inliers.size() < best.inliers.size() || inliers == best.inliers) break;
    best.inliers = inliers;
  }
  return best;
}

}  // namespace touchstone::sensors
