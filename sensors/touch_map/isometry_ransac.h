#pragma once
// RANSAC [Fischler1981] for an isometry of the plane from pairs of points, most of which may be wrong [Li2015, sec.
// 3.3.1].

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sensors/touch_map/planar_pose.h"

namespace touchstone::sensors {

/// A point that may be the image of another.
struct PointPair {
  Eigen::Vector2d from, to;  ///< mm
  int from_id = 0;           ///< pairs with one `from_id` share their point: at most one of them counts as an inlier
  int to_id = 0;             ///< the same for `to`
};

/// What an inlier is, and how many samples are drawn.
struct RansacSettings {
  double inlier_mm = 0.12;    ///< a pair is an inlier when the moved point is nearer than that to its partner
  double baseline_mm = 0.5;   ///< least distance between the two points of a sample
  int samples = 20000;        ///< most samples of two pairs
  double assurance = 0.9999;  ///< enough samples are drawn to meet one of two inliers with this probability
  std::uint64_t seed = 1;
};

/// Isometries near to one that was found: moved by at most `distance_mm` at the middle of the points, and turned by at
/// most `angle`.
struct PoseNeighbourhood {
  PlanarPose pose;
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();  ///< among the `from` points
  double distance_mm = 0.0;
  double angle = 0.0;

  /// Is the other one so near?
  bool holds(const PlanarPose& other) const;
};

/// The pose that most pairs agree with.
struct RansacResult {
  PlanarPose to_from_from;   ///< least squares over the inliers
  std::vector<int> inliers;  ///< indices of pairs, each point in one of them only
};

/// The isometry with the most inliers, refitted to them until they don't change. Poses in any of `except` aren't
/// considered.
/// Empty if no isometry has two inliers. The same arguments give the same answer.
std::optional<RansacResult> ransac_isometry(std::span<const PointPair> pairs, const RansacSettings& settings,
                                            std::span<const PoseNeighbourhood> except = {});

}  // namespace touchstone::sensors
