#pragma once
// What a robot needs before its first grasp: a sensor that was calibrated by a ball and by known forces; and the
// estimators on it, one set for each trial.

#include <opencv2/core/mat.hpp>

#include "lab/gelsight_grasp_experiment.h"
#include "sensors/height_model.h"
#include "sensors/linear_force.h"
#include "sensors/marker_tracker.h"
#include "sensors/slip_rule.h"
#include "sim/touch_rig.h"

namespace touchstone::lab {

/// One sensor with markers, calibrated.
struct GraspCalibration {
  sensors::HeightModel height;  ///< of frames whose markers are filled
  sensors::LinearForce normal;  ///< of the height map's sum, mm^3, from a ball of 12.7 mm
  sensors::LinearForce shear;   ///< of the mean marker displacement, mm, from a flat end of 10 mm
  sensors::MarkerTrackerSettings markers;
  cv::Mat background;  ///< one frame of the untouched gel
};

/// `flat` is the same sensor without markers, on which a 2 mm ball makes the height table (text 2.2.2); the force lines
/// are made on `marked` as in figs. 4-1 and 4-6. `seed` chooses the frames' noise. @throws Error as the estimators do
GraspCalibration calibrate_for_grasps(const sim::TouchRig& flat, const sim::TouchRig& marked, std::uint64_t seed);

struct GraspSenseSettings {
  sensors::SlipThresholds rule;  ///< of the text's two ratios
  bool rim = true;               ///< slip that begins at the contact's rim counts, too (sensors/incipient_slip.h)
  /// After slip was told, the rim's detector forgets its frames for so many: the gripper's answer, seen a camera's lag
  /// later, moves the contact too, and would be taken for slip and answered again.
  int forget_frames = 4;
};

/// The estimators of one trial. The calibration is copied.
GraspSenses grasp_senses(const GraspCalibration& calibration, const GraspSenseSettings& settings);

}  // namespace touchstone::lab
