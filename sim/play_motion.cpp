#include <algorithm>
#include <cmath>
#include <optional>

#include "core/error.h"
#include "core/units.h"
#include "fem/finite_press.h"
#include "sim/gel_setup.h"
#include "sim/shaken_press.h"
#include "sim/virtual_sensor.h"

namespace touchstone::sim {
namespace {

using fem::AxisControl;

constexpr double kStepsAPeriod = 12.0;

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

/// The press that the plan calls for, of one rigid body.
class PlannedPress {
 public:
  PlannedPress(const SceneSpec& scene, const Plan& plan, const fem::Compliance& gel) {
    const double friction = plan.friction ? scene.object.friction : 0.0;
    const fem::ContactShape shape = coarse_contact_shape(scene.object, scene.device.mesh.fine_mm);
    if (plan.finite_strain) {
      finite_gel_ = set_up_finite_gel(scene.device);
      TS_ASSERT(finite_gel_->rest.vertices == gel.vertices);
      finite_.emplace(*finite_gel_, shape, friction);
    } else {
      const auto series = plan.relaxation ? prony_series(scene.device.gel) : fem::PronySeries{};
      linear_.emplace(gel, shape, friction, fem::PressTolerance{}, series);
    }
  }

  const fem::PressState& step(const fem::PressTarget& target) {
    return finite_ ? finite_->step(target) : linear_->step(target);
  }
  const fem::PressState& state() const { return finite_ ? finite_->state() : linear_->state(); }

 private:
  std::shared_ptr<const fem::FiniteGel> finite_gel_;
  std::optional<fem::FinitePress> finite_;
  std::optional<fem::Press> linear_;
};

/// Steps a frame, so that a press that remembers follows a quasi-static vibration.
int steps_a_frame(const MotionKey& key, const MotionSpec& motion, const Plan& plan) {
  if (!key.vibration || !(plan.friction || plan.relaxation)) return 1;
  return std::max(1, static_cast<int>(std::ceil(kStepsAPeriod * key.vibration->frequency_Hz / motion.frame_rate_Hz)));
}

}  // namespace

std::vector<Truth> play_motion(const SceneSpec& scene, const Plan& plan, const fem::Compliance& gel,
                               const Progress& progress, const fem::GelVibration* vibration) {
  const MotionSpec& motion = scene.motion;
  const double friction = plan.friction ? scene.object.friction : 0.0;
  const fem::PronySeries relaxation = plan.relaxation ? prony_series(scene.device.gel) : fem::PronySeries{};
  PlannedPress press(scene, plan, gel);
  std::optional<ShakenPress> shaken;
  if (vibration != nullptr) shaken.emplace(gel, *vibration, relaxation, friction);

  fem::PressTarget target;
  Eigen::Vector3d angles_deg = motion.start_angles_deg;
  target.rotation = rotation_from_xyz(angles_deg * kRadiansPerDegree);
  for (int axis = 0; axis < 3; ++axis) target.axis[axis] = {AxisControl::Kind::position, motion.start_mm[axis]};

  std::vector<Truth> truths;
  truths.reserve(motion.frame_count());
  const auto keep = [&](fem::PressState state) {
    const int frame = static_cast<int>(truths.size());
    truths.push_back({frame, frame_time(frame, motion.frame_rate_Hz), std::move(state), {}});
    truths.back().error = fem::estimate_error(gel, truths.back().press);
    if (progress) progress("mechanics", frame + 1, motion.frame_count());
  };
  const auto at_frame = [&](const SourceLocation& where, const auto& act) {
    try {
      act();
    } catch (const Error& error) {
      fail_at(where, "frame {}: {}", truths.size(), error.what());
    }
  };
  at_frame(motion.keys.empty() ? scene.where : motion.keys.front().where, [&] { keep(press.step(target)); });

  for (const MotionKey& key : motion.keys) {
    const fem::PressState& now = press.state();
    const std::optional<AxisKey>* axis_keys[3] = {&key.x, &key.y, &key.z};
    const bool shakes = key.vibration && key.vibration->amplitude_mm > 0.0;
    if (shakes) {
      AxisControl& along = target.axis[static_cast<int>(key.vibration->axis)];
      if (along.kind == AxisControl::Kind::force) {
        along = AxisControl::at(now.gel_from_object.translation[static_cast<int>(key.vibration->axis)]);
      }
    }
    std::array<Ramp, 3> ramps;
    for (int axis = 0; axis < 3; ++axis) {
      ramps[axis] =
          ramp_of(*axis_keys[axis], target.axis[axis], now.gel_from_object.translation[axis], now.wrench[axis]);
    }
    const Eigen::Vector3d from_angles = angles_deg;
    const Eigen::Vector3d to_angles = key.angles_deg.value_or(angles_deg);
    const int steps = shaken ? 1 : steps_a_frame(key, motion, plan);
    const auto step = [&](double frames) {
      const double part = frames / key.frames;
      for (int axis = 0; axis < 3; ++axis) {
        target.axis[axis] = {ramps[axis].kind, ramps[axis].from + part * (ramps[axis].to - ramps[axis].from)};
      }
      angles_deg = from_angles + part * (to_angles - from_angles);
      target.rotation = rotation_from_xyz(angles_deg * kRadiansPerDegree);
      target.seconds = 1.0 / (steps * motion.frame_rate_Hz);
      fem::PressTarget there = target;
      if (shakes && !shaken) {
        there.axis[static_cast<int>(key.vibration->axis)].value +=
            key.vibration->amplitude_mm *
            std::sin(2.0 * kPi * key.vibration->frequency_Hz * frames / motion.frame_rate_Hz);
      }
      press.step(there);
    };
    for (int i = 1; i <= key.frames; ++i) {
      at_frame(key.where, [&] {
        for (int k = 1; k <= steps; ++k) step(k == steps ? i : i - 1 + static_cast<double>(k) / steps);
        keep(shakes && shaken ? shaken->at(press.state(), *key.vibration, i / motion.frame_rate_Hz) : press.state());
      });
    }
  }
  return truths;
}

}  // namespace touchstone::sim
