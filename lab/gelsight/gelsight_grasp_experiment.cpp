#include "lab/gelsight/gelsight_grasp_experiment.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <deque>

#include "core/error.h"
#include "core/units.h"

namespace touchstone::lab {
namespace {

constexpr double kStill_mm = 1e-3;  // less than that isn't called sliding

sim::Gripper gripper_for(const sim::VirtualSensor& sensor, const sim::TouchObject& object, const GraspTrial& trial,
                         double clearance_mm) {
  const sim::ObjectSpec& spec = trial.object;
  if (!spec.mass_g || !spec.crush_force_N) {
    fail("object {}: has no {}; a grasp needs both mass_g and crush_force_N", spec.name,
         spec.mass_g ? "crush_force_N" : "mass_g");
  }
  sim::GraspedBody body;
  body.shape = object.shape();
  body.friction = spec.friction;
  body.mass_g = *spec.mass_g;
  body.crush_force_N = *spec.crush_force_N;
  sim::GripperSettings settings;
  settings.clearance_mm = clearance_mm;
  settings.gel_from_object.rotation =
      Eigen::AngleAxisd(trial.turn_deg * kRadiansPerDegree, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  settings.gel_from_object.translation = {trial.place_mm.x(), trial.place_mm.y(), 0.0};
  return {sensor.gel(), body, settings};
}

/// Why the object doesn't count as held at the end of a trial; empty where it does.
std::string failure_of(const std::vector<GraspMoment>& moments, const GraspLoopSettings& settings, int hold_frames) {
  const GraspMoment& last = moments.back();
  if (last.truth.crushed) return fmt::format("crushed at {:.3g} N", last.truth.peak_normal_force_N);
  if (last.truth.dropped) return "dropped";
  if (sensors::has_ended_badly(last.phase)) return fmt::format("the rule ended: {}", name_of(last.phase));
  if (last.truth.on_table) return "left on the table";
  if (last.phase != sensors::GraspPhase::holding) return "never at rest in the fingers";
  const auto frames = static_cast<int>(moments.size());
  const GraspMoment& then = moments[static_cast<std::size_t>(std::max(0, frames - 1 - hold_frames))];
  if (last.truth.slid_mm - then.truth.slid_mm > kStill_mm) return "slides while it is held";
  if (last.truth.object_height_mm < 0.5 * settings.arm.height_mm) return "lifted less than half the height";
  return "";
}

/// Frames in which slip was reported though the object hadn't moved in the fingers for two lags and a frame.
int count_false_alarms(const std::vector<GraspMoment>& moments, int lag_frames) {
  int alarms = 0;
  for (std::size_t k = 0; k < moments.size(); ++k) {
    const std::size_t before = k - std::min(k, static_cast<std::size_t>(2 * lag_frames + 1));
    alarms += moments[k].reading.slip && moments[k].truth.slid_mm - moments[before].truth.slid_mm <= kStill_mm;
  }
  return alarms;
}

}  // namespace

GraspOutcome run_grasp_trial(const sim::VirtualSensor& sensor, const GraspTrial& trial,
                             const GraspLoopSettings& settings, const GraspSenses& senses) {
  if (!(settings.frame_rate_Hz > 0.0) || !(settings.camera_lag_s >= 0.0) || !(settings.hold_s >= 0.0) ||
      !(settings.longest_s > settings.hold_s)) {
    fail("a grasp's loop of {} frames/s, a lag of {} s, {} s of holding and at most {} s makes no sense",
         settings.frame_rate_Hz, settings.camera_lag_s, settings.hold_s, settings.longest_s);
  }
  const double dt = 1.0 / settings.frame_rate_Hz;
  const auto frames_in = [&](double seconds) { return static_cast<int>(std::lround(seconds / dt)); };
  const int lag_frames = frames_in(settings.camera_lag_s);
  const int hold_frames = frames_in(settings.hold_s);
  const sim::TouchObject object = sensor.object(trial.object);
  sim::Gripper gripper = gripper_for(sensor, object, trial, settings.clearance_mm);
  sim::ArmLift arm(settings.arm);
  sensors::GraspRule rule(settings.rule);

  GraspOutcome outcome;
  sensors::GraspCommand command;
  std::deque<cv::Mat> in_transit;  // frames that were taken and haven't arrived
  int frame = 0;
  for (; frame < lag_frames; ++frame) in_transit.push_back(sensor.background(trial.noise_seed, frame));
  int held_frames = 0;
  const int last_frame = frames_in(settings.longest_s);
  for (int k = 0; k < last_frame; ++k, ++frame) {
    const double acceleration = arm.next(command.lift, dt);
    const sim::GripperState& truth = gripper.advance(command.close_by_mm, acceleration, dt);
    in_transit.push_back(sensor.capture(object, gripper.press(), trial.noise_seed, frame, false).frame);
    GraspMoment moment;
    moment.truth = truth;
    moment.reading = senses(in_transit.front());
    moment.reading.lifted = arm.done();
    in_transit.pop_front();
    command = rule.next(moment.reading);
    moment.phase = command.phase;
    outcome.moments.push_back(moment);
    held_frames = command.phase == sensors::GraspPhase::holding ? held_frames + 1 : 0;
    if (truth.crushed || truth.dropped || sensors::has_ended_badly(command.phase) || held_frames > hold_frames) break;
  }

  const sim::GripperState& end = gripper.state();
  outcome.failure = failure_of(outcome.moments, settings, hold_frames);
  outcome.held = outcome.failure.empty();
  outcome.peak_force_N = end.peak_normal_force_N;
  outcome.crush_force_N = *trial.object.crush_force_N;
  outcome.final_force_N = end.normal_force_N;
  outcome.slid_mm = end.slid_mm;
  outcome.slip_reactions = rule.slip_reactions();
  outcome.false_alarms = count_false_alarms(outcome.moments, lag_frames);
  return outcome;
}

}  // namespace touchstone::lab
