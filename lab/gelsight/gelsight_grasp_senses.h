#pragma once
// What a robot needs before its first grasp: a sensor that was calibrated by a ball and by known forces; and the
// estimators on it, one set for each trial.

#include <cstdint>

#include "lab/gelsight/gelsight_grasp_experiment.h"
#include "sensors/markers/slip_rule.h"
#include "sensors/markers/touch_reader.h"
#include "sim/sensor/virtual_sensor.h"

namespace touchstone::lab {

/// A sensor with markers, calibrated. `flat` is the same sensor without markers, on which a 2 mm ball makes the height
/// table [Li2015, sec. 2.2.2]; the force lines are made on `marked` as in figs. 4-1 and 4-6, by a ball of 12.7 mm and a
/// flat end of 10 mm. `seed` chooses the frames' noise. @throws Error as the estimators do
sensors::TouchCalibration calibrate_for_grasps(const sim::VirtualSensor& flat, const sim::VirtualSensor& marked,
                                               std::uint64_t seed);

/// What counts as slip in the loop.
struct GraspSenseSettings {
  sensors::SlipThresholds rule;  ///< of the thesis's two ratios
  bool rim = true;  ///< slip that begins at the contact's rim counts, too (sensors/markers/incipient_slip.h)
  /// After slip was reported, the rim's detector forgets its frames for so many: the gripper's answer, seen a camera's
  /// lag later, moves the contact too, and would be taken for slip and answered again.
  int forget_frames = 4;
};

/// The estimators of one trial. The calibration is copied.
GraspSenses grasp_senses(const sensors::TouchCalibration& calibration, const GraspSenseSettings& settings);

}  // namespace touchstone::lab
