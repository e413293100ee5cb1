#pragma once
// Direct alignment: the isometry under which two height images agree best, found from a nearby one by Gauss-Newton
// steps on all their pixels ([Lucas1981], on SE(2)). Keypoints stand on whole pixels of a scale space and give a pose
// to a part of a pixel at best; all pixels together give it finer.

#include "sensors/touch_map/planar_pose.h"
#include "sensors/touch_map/relief_detail.h"

namespace touchstone::sensors {

/// When the search ends, and how many pixels it takes.
struct AlignmentSettings {
  int most_steps = 40;
  double least_step_mm = 5e-4;      ///< a smaller step is the last
  double most_moved_mm = 0.5;       ///< from the start, at the middle of the overlap; beyond that it has gone astray
  std::size_t most_pixels = 20000;  ///< of `from`, evenly chosen
};

/// The pose found, and how well the heights agree under it.
struct Alignment {
  PlanarPose to_from_from;
  double correlation = 0.0;  ///< weighted, of both details over the overlap: -1 to 1; 0 without an overlap
  double overlap = 0.0;      ///< share of the weight of `from` that lies on touched parts of `to`
  int steps = 0;
  bool converged = false;  ///< else `to_from_from` is the start
};

/// Minimises the sum of w (g from(p) + b - to(T p))^2 over the isometry T, the gain g and the offset b, where w is the
/// product of both weights with Tukey's biweight [Beaton1974] of the residual. The gain takes up that a deeper press
/// imprints more.
Alignment align(const ReliefDetail& from, const ReliefDetail& to, const PlanarPose& start,
                const AlignmentSettings& settings);

/// The correlation and overlap under a pose, without any step.
Alignment compare(const ReliefDetail& from, const ReliefDetail& to, const PlanarPose& pose,
                  const AlignmentSettings& settings);

}  // namespace touchstone::sensors
