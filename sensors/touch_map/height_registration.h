#pragma once
// Registration of one touch with another, or with a map: features, RANSAC, confidence [Li2015, sec. 3.3.1], then direct
// alignment.

#include <string>

#include "sensors/touch_map/height_alignment.h"
#include "sensors/touch_map/height_features.h"
#include "sensors/touch_map/isometry_ransac.h"
#include "sensors/touch_map/planar_pose.h"
#include "sensors/touch_map/relief_detail.h"

namespace touchstone::sensors {

/// The settings of all steps, and from when on a pose is believed.
struct RegistrationSettings {
  DetailSettings detail;
  FeatureSettings features;
  MatchSettings match;
  RansacSettings ransac;
  AlignmentSettings alignment;
  double least_confidence = 0.98;  ///< of eq. 2, as published
  int least_inliers = 6;           ///< two pairs always agree; so few can by chance
  /// Ours: RANSAC is asked for more poses, each elsewhere than those before; all are tried on the heights, and the one
  /// under which these agree best is taken. Relief with symmetries, as a plug's, has several poses of many inliers.
  int most_candidates = 4;
  double elsewhere_mm = 0.5;
  double elsewhere_angle = 0.1;  ///< radians
  double least_share = 0.4;      ///< of the best candidate's inliers, for another to be one
  /// Ours: what the best pose leaves unexplained (1 - correlation), as a share of what the next candidate leaves, or
  /// the pose moved by `elsewhere_mm` in any direction; more is ambiguous. Turned by half a turn, a plug still
  /// correlates by 0.7.
  double most_rival_share = 0.75;
  double least_overlap = 0.25;     ///< ours: share of the touch that must lie on the map
  bool refine = true;              ///< ours: the pose by direct alignment of the heights; else the features' one
  double least_correlation = 0.6;  ///< ours: of the details under the aligned pose
};

/// Why a touch was, or wasn't, localised.
enum class Outcome {
  localised,
  no_contact,      ///< nothing was touched
  no_texture,      ///< too few features: a plane, an edge
  no_match,        ///< too few of them agree with one isometry
  low_confidence,  ///< the best map of the inliers isn't an isometry (eq. 2)
  ambiguous,       ///< the heights agree nearly as well elsewhere: a repeating pattern
  disagrees,       ///< the heights differ under the pose found, or hardly overlap
};
/// For messages: "localised", "no contact", "low confidence", ...
std::string name_of(Outcome outcome);

/// The pose of one touch, or why there is none.
struct Registration {
  Outcome outcome = Outcome::no_contact;
  PlanarPose to_from_from;  ///< the refined pose where that was asked for and found, else the features' one. Means
                            ///< something only where localised
  PlanarPose feature_pose;  ///< least squares over the inliers, as in the thesis
  bool refined = false;     ///< whether to_from_from is by direct alignment
  double confidence = 0.0;  ///< eq. 2
  int features = 0;         ///< of `from`
  int matches = 0;          ///< pairs under the Hamming threshold
  int inliers = 0;
  double runner_up = 0.0;    ///< the best correlation under any other pose that was tried
  double correlation = 0.0;  ///< of the details, under the aligned pose, whether that is asked for or not
  double overlap = 0.0;      ///< share of `from` that lies on `to`

  bool localised() const { return outcome == Outcome::localised; }
};

/// A surface made ready to be registered.
struct DescribedSurface {
  ReliefDetail detail;
  HeightFeatures features;
};

/// A pure function of its arguments. Where the outcome isn't `localised`, what was found until then is given all the
/// same. @throws Error where the pixels' pitches differ by more than 1 %
Registration register_surfaces(const DescribedSurface& from, const DescribedSurface& to,
                               const RegistrationSettings& settings);

}  // namespace touchstone::sensors
