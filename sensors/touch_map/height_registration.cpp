#include "sensors/touch_map/height_registration.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/error.h"

namespace touchstone::sensors {
namespace {

constexpr double kSamePitch = 0.01;

Eigen::Vector2d middle_of(const std::vector<PointPair>& pairs, const std::vector<int>& inliers) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const int i : inliers) sum += pairs[i].from;
  return sum / static_cast<double>(inliers.size());
}

double confidence_of(const std::vector<PointPair>& pairs, const std::vector<int>& inliers) {
  std::vector<Eigen::Vector2d> from, to;
  for (const int i : inliers) {
    from.push_back(pairs[i].from);
    to.push_back(pairs[i].to);
  }
  return isometry_confidence(least_squares_linear_part(to, from));
}

/// A pose that RANSAC found, and how the heights agree under it.
struct Candidate {
  RansacResult features;
  Alignment heights;
};

std::vector<Candidate> candidates_of(const DescribedSurface& from, const DescribedSurface& to,
                                     const std::vector<PointPair>& pairs, const RegistrationSettings& settings) {
  std::vector<Candidate> candidates;
  std::vector<PoseNeighbourhood> known;
  while (static_cast<int>(candidates.size()) < settings.most_candidates) {
    const auto found = ransac_isometry(pairs, settings.ransac, known);
    if (!found) break;
    const auto inliers = static_cast<double>(found->inliers.size());
    if (!candidates.empty() &&
        inliers < settings.least_share * static_cast<double>(candidates.front().features.inliers.size())) {
      break;
    }
    const PlanarPose& pose = found->to_from_from;
    candidates.push_back({*found, align(from.detail, to.detail, pose, settings.alignment)});
    known.push_back({pose, middle_of(pairs, found->inliers), settings.elsewhere_mm, settings.elsewhere_angle});
  }
  return candidates;
}

/// The best correlation elsewhere: of the other candidates that aren't the same pose after all, and of the pose moved a
/// little in any direction, which an edge or a grating wouldn't show.
double rival_of(const Candidate& best, const std::vector<Candidate>& candidates, const DescribedSurface& from,
                const DescribedSurface& to, const std::vector<PointPair>& pairs, const RegistrationSettings& settings) {
  const PlanarPose& pose = best.heights.to_from_from;
  const PoseNeighbourhood here{pose, middle_of(pairs, best.features.inliers), settings.elsewhere_mm,
                               settings.elsewhere_angle};
  double rival = 0.0;
  for (const Candidate& other : candidates) {
    if (here.holds(other.heights.to_from_from) || other.heights.overlap < settings.least_overlap) continue;
    rival = std::max(rival, other.heights.correlation);
  }
  constexpr int kDirections = 8;
  for (int i = 0; i < kDirections; ++i) {
    const double angle = 2.0 * kPi * i / kDirections;
    PlanarPose moved = pose;
    moved.translation += settings.elsewhere_mm * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    rival = std::max(rival, compare(from.detail, to.detail, moved, settings.alignment).correlation);
  }
  return rival;
}

}  // namespace

std::string name_of(Outcome outcome) {
  switch (outcome) {
    case Outcome::localised:
      return "localised";
    case Outcome::no_contact:
      return "no contact";
    case Outcome::no_texture:
      return "no texture";
    case Outcome::no_match:
      return "no match";
    case Outcome::low_confidence:
      return "low confidence";
    case Outcome::ambiguous:
      return "ambiguous";
    case Outcome::disagrees:
      return "heights disagree";
  }
  return "";
}

Registration register_surfaces(const DescribedSurface& from, const DescribedSurface& to,
                               const RegistrationSettings& settings) {
  const double pitch = from.detail.frame.mm_per_px, other_pitch = to.detail.frame.mm_per_px;
  if (std::abs(pitch - other_pitch) > kSamePitch * other_pitch) {
    fail("the touch has {} mm a pixel, the map {}; they must agree to 1 %", pitch, other_pitch);
  }
  Registration result;
  const auto end = [&](Outcome outcome) {
    result.outcome = outcome;
    return result;
  };
  if (!(from.detail.rms_mm > 0.0)) return end(Outcome::no_contact);
  const std::size_t least = static_cast<std::size_t>(std::max(settings.least_inliers, 2));
  result.features = static_cast<int>(from.features.points.size());
  if (from.features.points.size() < least) return end(Outcome::no_texture);

  std::vector<PointPair> pairs;
  for (const FeatureMatch& one : match(from.features, to.features, settings.match)) {
    pairs.push_back({from.features.points[one.from], to.features.points[one.to], one.from, one.to});
  }
  result.matches = static_cast<int>(pairs.size());
  std::vector<Candidate> candidates = candidates_of(from, to, pairs, settings);
  if (candidates.empty()) return end(Outcome::no_match);
  // Stable: of equals the one with more inliers stays first.
  std::stable_sort(candidates.begin(), candidates.end(), [&](const Candidate& a, const Candidate& b) {
    const auto rank = [&](const Candidate& one) {
      return one.heights.overlap < settings.least_overlap ? -1.0 : one.heights.correlation;
    };
    return rank(a) > rank(b);
  });
  const Candidate& best = candidates.front();
  result.feature_pose = best.features.to_from_from;
  result.inliers = static_cast<int>(best.features.inliers.size());
  result.confidence = confidence_of(pairs, best.features.inliers);
  result.refined = settings.refine && best.heights.converged;
  result.to_from_from = result.refined ? best.heights.to_from_from : result.feature_pose;
  result.correlation = best.heights.correlation;
  result.overlap = best.heights.overlap;
  result.runner_up = rival_of(best, candidates, from, to, pairs, settings);

  if (best.features.inliers.size() < least) return end(Outcome::no_match);
  if (!(result.confidence > settings.least_confidence)) return end(Outcome::low_confidence);
  if (result.correlation < settings.least_correlation || result.overlap < settings.least_overlap) {
    return end(Outcome::disagrees);
  }
  if (1.0 - result.correlation > settings.most_rival_share * (1.0 - result.runner_up)) return end(Outcome::ambiguous);
  return end(Outcome::localised);
}

}  // namespace touchstone::sensors
