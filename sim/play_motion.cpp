#include <cmath>

#include "core/units.h"
#include "sim/virtual_sensor.h"

namespace touchstone::sim {
namespace {

using fem::AxisControl;

/// What an axis is led to over the frames of a key.
struct Ramp {
  AxisControl::Kind kind = AxisControl::Kind::position;
  double from = 0.0;
  double to = 0.0;
};

Ramp ramp_of(const std::optional<AxisKey>& key, const AxisControl& held, double position, double force) {
  if (!key) return {held.kind, held.value, held.value};
  if (key->position_mm) {
    return {AxisControl::Kind::position, held.kind == AxisControl::Kind::position ? held.value : position,
            *key->position_mm};
  }
  return {AxisControl::Kind::force, held.kind == AxisControl::Kind::force ? held.value : force, *key->force_N};
}

std::int64_t frame_time(int frame, double rate) {
  return static_cast<std::int64_t>(std::llround(frame * kMicrosecondsPerSecond / rate));
}

}  // namespace

std::vector<Truth> play_motion(const SceneSpec& scene, const Plan& plan, const fem::Compliance& gel,
                               const Progress& progress) {
  const MotionSpec& motion = scene.motion;
  fem::Press press(gel, contact_shape(scene.object.shape), plan.friction ? scene.object.friction : 0.0);

  fem::PressTarget target;
  Eigen::Vector3d angles_deg = motion.start_angles_deg;
  target.rotation = rotation_from_xyz(angles_deg * kRadiansPerDegree);
  for (int axis = 0; axis < 3; ++axis) target.axis[axis] = {AxisControl::Kind::position, motion.start_mm[axis]};

  std::vector<Truth> truths;
  truths.reserve(motion.frame_count());
  const auto step = [&](const SourceLocation& where) {
    const int frame = static_cast<int>(truths.size());
    try {
      truths.push_back({frame, frame_time(frame, motion.frame_rate_Hz), press.step(target), {}});
      truths.back().error = fem::estimate_error(gel, truths.back().press);
    } catch (const Error& error) {
      fail_at(where, "frame {}: {}", frame, error.what());
    }
    if (progress) progress("mechanics", frame + 1, motion.frame_count());
  };
  step(motion.keys.empty() ? scene.where : motion.keys.front().where);

  for (const MotionKey& key : motion.keys) {
    const fem::PressState& now = press.state();
    const std::optional<AxisKey>* axis_keys[3] = {&key.x, &key.y, &key.z};
    std::array<Ramp, 3> ramps;
    for (int axis = 0; axis < 3; ++axis) {
      ramps[axis] =
          ramp_of(*axis_keys[axis], target.axis[axis], now.gel_from_object.translation[axis], now.wrench[axis]);
    }
    const Eigen::Vector3d from_angles = angles_deg;
    const Eigen::Vector3d to_angles = key.angles_deg.value_or(angles_deg);
    for (int i = 1; i <= key.frames; ++i) {
      const double part = static_cast<double>(i) / key.frames;
      for (int axis = 0; axis < 3; ++axis) {
        target.axis[axis] = {ramps[axis].kind, ramps[axis].from + part * (ramps[axis].to - ramps[axis].from)};
      }
      angles_deg = from_angles + part * (to_angles - from_angles);
      target.rotation = rotation_from_xyz(angles_deg * kRadiansPerDegree);
      step(key.where);
    }
  }
  return truths;
}

}  // namespace touchstone::sim
