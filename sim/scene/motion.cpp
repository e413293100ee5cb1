#include "sim/scene/motion.h"

#include <algorithm>

namespace touchstone::sim {
namespace {

constexpr std::int64_t kMostFrames = 1'000'000'000;  // an int counts them

}  // namespace

int MotionSpec::frame_count() const {
  int count = 1;
  for (const MotionKey& key : keys) count += key.frames;
  return count;
}

bool MotionSpec::is_turned() const {
  return std::any_of(keys.begin(), keys.end(),
                     [](const MotionKey& key) { return key.turn_x || key.turn_y || key.turn_z; });
}

bool MotionSpec::is_tangential() const {
  if (is_turned()) return true;
  for (const MotionKey& key : keys) {
    if (key.vibration && key.vibration->axis != Axis::z && key.vibration->amplitude_mm > 0.0) return true;
    if (key.angles_deg && *key.angles_deg != start_angles_deg) return true;
    for (const auto& [axis, start] : {std::pair{key.x, start_mm.x()}, std::pair{key.y, start_mm.y()}}) {
      if (!axis) continue;
      if (axis->force_N) return true;
      if (axis->position_mm && *axis->position_mm != start) return true;
    }
  }
  return start_angles_deg != Eigen::Vector3d::Zero();
}

double MotionSpec::highest_vibration_Hz() const {
  double highest = 0.0;
  for (const MotionKey& key : keys) {
    if (key.vibration && key.vibration->amplitude_mm > 0.0) highest = std::max(highest, key.vibration->frequency_Hz);
  }
  return highest;
}

EnumNames<Axis> enum_names(Axis) {
  return {{"x", Axis::x}, {"y", Axis::y}, {"z", Axis::z}};
}

void fields(YamlReader& in, AxisKey& axis) {
  in.optional("position_mm", axis.position_mm);
  in.optional("force_N", axis.force_N);
  in.exactly_one_of({"position_mm", "force_N"});
}

void fields(YamlReader& in, VibrationSpec& vibration) {
  in.required("axis", vibration.axis);
  in.required("amplitude_mm", vibration.amplitude_mm, Allowed::at_least(0.0));
  in.required("frequency_Hz", vibration.frequency_Hz, Allowed::above_up_to(0.0, 1e5));
}

void fields(YamlReader& in, TurnKey& turn) {
  in.required("torque_Nmm", turn.torque_Nmm);
}

void fields(YamlReader& in, MotionKey& key) {
  key.where = in.where();
  in.required("frames", key.frames, Allowed::within(1, 1e7));
  in.optional("x", key.x);
  in.optional("y", key.y);
  in.optional("z", key.z);
  in.optional("angles_deg", key.angles_deg, Allowed::within(-180.0, 180.0));
  in.optional("turn_x", key.turn_x);
  in.optional("turn_y", key.turn_y);
  in.optional("turn_z", key.turn_z);
  in.not_beside("angles_deg", {"turn_x", "turn_y", "turn_z"});  // one of them leads the rotation
  in.optional("vibration", key.vibration);
  if (key.vibration) {
    const std::optional<AxisKey>* const axes[] = {&key.x, &key.y, &key.z};
    const auto& along = *axes[static_cast<int>(key.vibration->axis)];
    if (along && along->force_N) {
      fail_at(in.where("vibration"), "vibration: the same key leads that axis to a force; it needs a position");
    }
  }
}

void fields(YamlReader& in, MotionSpec& motion) {
  in.required("start_mm", motion.start_mm);
  in.optional("start_angles_deg", motion.start_angles_deg, Allowed::within(-180.0, 180.0));
  in.optional("frame_rate_Hz", motion.frame_rate_Hz, Allowed::above_up_to(0.0, 1e6));
  in.required("keys", motion.keys);
  std::int64_t frames = 1;
  for (const MotionKey& key : motion.keys) frames += key.frames;
  if (frames > kMostFrames) {
    fail_at(in.where("keys"), "keys: {} frames in all; allowed are {}", frames, kMostFrames);
  }
}

}  // namespace touchstone::sim
