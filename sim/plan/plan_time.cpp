#include "sim/plan/plan_time.h"

#include <algorithm>
#include <cmath>

#include "core/units.h"
#include "sim/plan/image_motion.h"

namespace touchstone::sim {
namespace {

// Between kept states all runs straight. A point of the gel that the object meets in between is then off by at most a
// quarter of the travel, and a vibration is a polygon that is 4 % less high.
constexpr double kTravelBetweenStates_mm = 0.02;
constexpr double kStatesAPeriod = 12.0;
constexpr int kStatesUnderForce = 4;  // the travel isn't known beforehand
constexpr int kMostStates = 64;

int states_a_frame(const SceneSpec& scene, const MotionSpeed& speed) {
  double states = speed.mm_per_s / scene.motion.frame_rate_Hz / kTravelBetweenStates_mm;
  for (const MovedObject& moved : moved_objects(scene)) {
    states = std::max(states, kStatesAPeriod * moved.motion.highest_vibration_Hz() / scene.motion.frame_rate_Hz);
  }
  const int least = scene.outputs.events && speed.led_by_force ? kStatesUnderForce : 1;
  return std::clamp(static_cast<int>(std::ceil(std::min<double>(states, kMostStates))), least, kMostStates);
}

/// Where the outputs are asked for: in the scene, if not on the command line.
const SourceLocation& where_outputs(const SceneSpec& scene) {
  return scene.outputs.where.file.empty() ? scene.where : scene.outputs.where;
}

void refuse_impossible(const SceneSpec& scene) {
  const CameraSpec& camera = *scene.device.camera;
  const double frame_us = kMicrosecondsPerSecond / scene.motion.frame_rate_Hz;
  if (scene.outputs.light() && camera.exposure_us > frame_us) {
    fail_at(
        scene.where,
        "the camera of the device '{}' exposes for {} us, which is longer than a frame of the motion, {} us at {} Hz",
        scene.device.name, camera.exposure_us, frame_us, scene.motion.frame_rate_Hz);
  }
  if (scene.outputs.events && !camera.events) {
    fail_at(where_outputs(scene),
            "outputs.events: the camera of the device '{}' ({}) has no event pixels: no block camera.events",
            scene.device.name, scene.device.where.file);
  }
  if (scene.effects.motion_blur == Switch::on && camera.exposure_us == 0.0) {
    fail_at(scene.where, "effects.motion_blur: on, but the camera's exposure_us is 0: there is nothing to blur");
  }
  if (scene.effects.rolling_shutter == Switch::on && camera.row_time_us == 0.0) {
    fail_at(scene.where, "effects.rolling_shutter: on, but the camera has no row_time_us: its shutter is global");
  }
}

}  // namespace

void plan_time(const SceneSpec& scene, Plan& plan, PlanTable& table) {
  refuse_impossible(scene);
  const CameraSpec& camera = *scene.device.camera;
  const MotionSpeed speed = motion_speed(scene);
  const double tolerance = scene.light.motion_tolerance_px;
  const bool light = scene.outputs.light();
  const double blur = speed.pixels_per_s * camera.exposure_us / kMicrosecondsPerSecond;
  const double skew = speed.pixels_per_s * camera.row_time_us * (camera.height - 1) / kMicrosecondsPerSecond;
  const double sharp = tolerance * ImageScale(scene.device).point_width();
  const char* about = speed.led_by_force ? "some " : "";
  const char* cost = "a picture of what moves for every quarter of a pixel";

  // Without blur a picture shows the exposure's begin in place of its middle.
  std::optional<Change> blurred;
  std::optional<Change> skewed;
  if (light) {
    blurred = Change{.marker_px = 0.5 * blur};
    skewed = Change{.marker_px = skew};
  }
  const auto allowed = [&](double pixels) {
    return table.accuracy() ? "" : fmt::format("; allowed to leave out is {:.2g}", pixels);
  };
  plan.motion_blur =
      table.add_by_need("motion blur", light ? scene.effects.motion_blur : Switch::automatic, light && blur > sharp,
                        !light ? "no picture is asked for"
                               : fmt::format("in an exposure of {} us the image moves by up to {}{:.2g} pixels{}",
                                             camera.exposure_us, about, blur, allowed(sharp)),
                        cost, blurred);
  plan.rolling_shutter = table.add_by_need(
      "rolling shutter", light ? scene.effects.rolling_shutter : Switch::automatic, light && skew > tolerance,
      !light                      ? "no picture is asked for"
      : camera.row_time_us == 0.0 ? "the camera exposes all rows at once"
                                  : fmt::format("from the first row to the last the image moves by up to {}{:.2g} "
                                                "pixels{}",
                                                about, skew, allowed(tolerance)),
      cost, skewed);
  plan.events = table.add("event pixels", scene.outputs.events,
                          scene.outputs.events ? "a stream of events is asked for" : "no events are asked for",
                          "a picture of what changes for every half threshold that a pixel passes");
  // At finite strain a state costs more than all its light, and exposures do with straight paths from frame to frame.
  const bool exposed = (plan.motion_blur || plan.rolling_shutter) && !plan.finite_strain;
  if (exposed || plan.events) plan.states_a_frame = states_a_frame(scene, speed);
  if (plan.events && scene.motion.frame_rate_Hz * plan.states_a_frame > kMicrosecondsPerSecond) {
    fail_at(where_outputs(scene),
            "outputs.events: the motion has {} frames a second of {} states; events count whole us",
            scene.motion.frame_rate_Hz, plan.states_a_frame);
  }
}

}  // namespace touchstone::sim
