#pragma once
// Registration of one touch with another, or with a map: features, RANSAC, confidence (source text sec. 3.3.1), then
// direct alignment.

#include <string>

#include "sensors/height_alignment.h"
#include "sensors/height_features.h"
#include "sensors/isometry_ransac.h"
#include "sensors/planar_pose.h"
#include "sensors/relief_detail.h"

namespace touchstone::sensors {

struct RegistrationSettings {
  DetailSettings detail;
  FeatureSettings features;
  MatchSettings match;
  RansacSettings ransac;
  AlignmentSettings alignment;
  double least_confidence = 0.98;  ///< of eq. 2, as published
  int least_inliers = 8;           ///< two pairs always agree; so few can by chance
  /// Ours: a second pose, elsewhere, with more than this share of the best one's inliers makes the touch ambiguous.
  double most_runner_up = 0.6;
  double elsewhere_mm = 0.5;
  double elsewhere_angle = 0.1;    ///< radians
  bool refine = true;              ///< ours: the pose by direct alignment, from the features' one
  double least_correlation = 0.5;  ///< ours: of the details under the pose found
};

/// Why a touch was, or wasn't, localised.
enum class Outcome {
  localised,
  no_contact,      ///< nothing was touched
  no_texture,      ///< too few features: a plane, an edge
  no_match,        ///< too few of them agree with one isometry
  low_confidence,  ///< the best map of the inliers isn't an isometry (eq. 2)
  ambiguous,       ///< another pose explains nearly as much: a repeating pattern
  disagrees,       ///< the heights differ under the pose found
};
std::string name_of(Outcome outcome);

struct Registration {
  Outcome outcome = Outcome::no_contact;
  PlanarPose to_from_from;  ///< the refined pose where that was asked for and found, else the features' one. Means
                            ///< something only where localised
  PlanarPose feature_pose;  ///< least squares over the inliers, as in the text
  bool refined = false;     ///< whether to_from_from is by direct alignment
  double confidence = 0.0;  ///< eq. 2
  int features = 0;         ///< of `from`
  int matches = 0;          ///< pairs under the Hamming threshold
  int inliers = 0;
  double runner_up = 0.0;    ///< inliers of the best pose elsewhere, as a share of `inliers`
  double correlation = 0.0;  ///< of the details, under to_from_from
  double overlap = 0.0;      ///< share of `from` that lies on `to`

  bool localised() const { return outcome == Outcome::localised; }
};

/// A surface made ready to be registered.
struct DescribedSurface {
  ReliefDetail detail;
  HeightFeatures features;
};

/// A pure function of its arguments. Where the outcome isn't `localised`, what was found on the way is told all the
/// same. @throws Error where the pixels' pitches differ by more than 1 %
Registration register_surfaces(const DescribedSurface& from, const DescribedSurface& to,
                               const RegistrationSettings& settings);

}  // namespace touchstone::sensors
