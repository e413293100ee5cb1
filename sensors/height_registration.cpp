#include "sensors/height_registration.h"

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
  const auto best = ransac_isometry(pairs, settings.ransac);
  if (!best) return end(Outcome::no_match);
  result.to_from_from = result.feature_pose = best->to_from_from;
  result.inliers = static_cast<int>(best->inliers.size());
  result.confidence = confidence_of(pairs, best->inliers);

  const PoseNeighbourhood here{best->to_from_from, middle_of(pairs, best->inliers), settings.elsewhere_mm,
                               settings.elsewhere_angle};
  if (const auto second = ransac_isometry(pairs, settings.ransac, here)) {
    result.runner_up = static_cast<double>(second->inliers.size()) / static_cast<double>(best->inliers.size());
  }
  const Alignment alignment = settings.refine ? align(from.detail, to.detail, best->to_from_from, settings.alignment)
                                              : compare(from.detail, to.detail, best->to_from_from, settings.alignment);
  result.to_from_from = alignment.to_from_from;
  result.refined = alignment.converged;
  result.correlation = alignment.correlation;
  result.overlap = alignment.overlap;

  if (best->inliers.size() < least) return end(Outcome::no_match);
  if (!(result.confidence > settings.least_confidence)) return end(Outcome::low_confidence);
  if (result.runner_up > settings.most_runner_up) return end(Outcome::ambiguous);
  if (result.correlation < settings.least_correlation) return end(Outcome::disagrees);
  return end(Outcome::localised);
}

}  // namespace touchstone::sensors
