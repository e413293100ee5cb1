#pragma once
// The closed loop of [Li2015, sec. 4.5]: a simulated gripper lifts an object off a table, led by nothing but what
// estimators make of the camera's frames.

#include <cstdint>
#include <functional>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "sensors/markers/grasp_rule.h"
#include "sim/grasp/arm_lift.h"
#include "sim/grasp/gripper.h"
#include "sim/sensor/virtual_sensor.h"

namespace touchstone::lab {

/// What differs from trial to trial.
struct GraspTrial {
  sim::ObjectSpec object;                              ///< with its friction, and with mass_g and crush_force_N
  Eigen::Vector2d place_mm = Eigen::Vector2d::Zero();  ///< of the object's origin in the gel frame
  double turn_deg = 0.0;                               ///< of the object about the gel's normal
  std::uint64_t noise_seed = 1;
};

/// The loop's times and limits.
struct GraspLoopSettings {
  sensors::GraspRuleSettings rule;
  sim::ArmLiftSettings arm;
  double clearance_mm = 0.1;
  double frame_rate_Hz = 30.0;
  double camera_lag_s = 0.1;  ///< sec. 2.2.3; rounded to frames
  double hold_s = 1.0;        ///< how long it has to be held, without sliding
  double longest_s = 10.0;    ///< a trial is over then, held or not
};

/// What estimators make of the frames of one trial, handed over in their order; the first is of the untouched gel.
using GraspSenses = std::function<sensors::GraspReading(const cv::Mat& frame)>;

/// One frame of a trial: what was true, and what the rule was given and did.
struct GraspMoment {
  sim::GripperState truth;
  sensors::GraspReading reading;  ///< of the frame that was taken camera_lag_s before
  sensors::GraspPhase phase = sensors::GraspPhase::approaching;
};

/// How one trial ended.
struct GraspOutcome {
  bool held = false;    ///< lifted, held for hold_s without sliding, not crushed
  std::string failure;  ///< why not, for people; empty where it's held
  double peak_force_N = 0.0;
  double crush_force_N = 0.0;
  double final_force_N = 0.0;  ///< one finger's
  double slid_mm = 0.0;        ///< the object against the fingers, all in all
  int slip_reactions = 0;      ///< how often the rule closed further
  int false_alarms = 0;        ///< frames in which slip was reported though nothing slid since two lags before
  std::vector<GraspMoment> moments;
};

/// Plays one trial. @throws Error for an object without mass or crush force, or settings that make no sense
GraspOutcome run_grasp_trial(const sim::VirtualSensor& sensor, const GraspTrial& trial,
                             const GraspLoopSettings& settings, const GraspSenses& senses);

}  // namespace touchstone::lab
