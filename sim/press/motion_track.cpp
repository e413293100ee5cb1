#include "sim/press/motion_track.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "core/transform.h"
#include "core/units.h"

namespace touchstone::sim {
namespace {

using Kind = fem::AxisControl::Kind;

constexpr double kFullTurnDeg = 360.0;

/// The angles of rotation_from_xyz that give this rotation, of which there are many, next to `near_deg`; degrees.
Eigen::Vector3d angles_of(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& near_deg) {
  const double y = std::asin(std::clamp(-rotation(2, 0), -1.0, 1.0));
  const Eigen::Vector3d one(std::atan2(rotation(2, 1), rotation(2, 2)), y, std::atan2(rotation(1, 0), rotation(0, 0)));
  const Eigen::Vector3d other(one.x() + kPi, kPi - one.y(), one.z() + kPi);
  Eigen::Vector3d best;
  double least = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& angles : {one, other}) {
    Eigen::Vector3d degrees = angles / kRadiansPerDegree;
    for (int a = 0; a < 3; ++a) degrees[a] += kFullTurnDeg * std::round((near_deg[a] - degrees[a]) / kFullTurnDeg);
    const double distance = (degrees - near_deg).norm();
    if (distance < least) {
      least = distance;
      best = degrees;
    }
  }
  return best;
}

}  // namespace

MotionTrack::MotionTrack(const MotionSpec& motion) : motion_(motion), angles_deg_(motion.start_angles_deg) {
  target_.rotation = rotation_from_xyz(angles_deg_ * kRadiansPerDegree);
  for (int a = 0; a < 3; ++a) target_.axis[a] = {Kind::position, motion.start_mm[a]};
}

const MotionKey& MotionTrack::key() const {
  TS_ASSERT(next_key_ > 0);
  return motion_.keys[static_cast<std::size_t>(next_key_ - 1)];
}

double MotionTrack::seconds_in_key() const {
  return frame_ / motion_.frame_rate_Hz;
}

void MotionTrack::next_frame(const fem::BodyState& now) {
  if (next_key_ == 0 || frame_ == key().frames) {
    TS_ASSERT(next_key_ < static_cast<int>(motion_.keys.size()));
    ++next_key_;
    frame_ = 0;
    begin_key(key(), now);
  }
  ++frame_;
}

void MotionTrack::begin_key(const MotionKey& key, const fem::BodyState& now) {
  const Eigen::Vector3d position = now.gel_from_object.translation;
  const Eigen::Vector3d force = now.wrench.head<3>();
  const Eigen::Vector3d torque = Eigen::Vector3d(now.wrench.tail<3>()) - position.cross(force);
  if (key.vibration && key.vibration->amplitude_mm > 0.0) {
    const int along = static_cast<int>(key.vibration->axis);
    if (target_.axis[along].kind == Kind::force) target_.axis[along] = fem::AxisControl::at(position[along]);
  }
  const std::optional<AxisKey>* const axes[3] = {&key.x, &key.y, &key.z};
  for (int a = 0; a < 3; ++a) {
    fem::AxisControl& held = target_.axis[a];
    translation_[a] = {held.value, held.value};
    if (!*axes[a]) continue;
    const AxisKey& axis = **axes[a];
    const Kind kind = axis.position_mm ? Kind::position : Kind::force;
    if (held.kind != kind) translation_[a].from = kind == Kind::position ? position[a] : force[a];
    translation_[a].to = kind == Kind::position ? *axis.position_mm : *axis.force_N;
    held.kind = kind;
  }
  if (key.angles_deg) {
    const bool turned = target_.torque[0] || target_.torque[1] || target_.torque[2];
    if (turned) angles_deg_ = angles_of(now.gel_from_object.rotation, angles_deg_);
    target_.torque = {};
  }
  const std::optional<TurnKey>* const turns[3] = {&key.turn_x, &key.turn_y, &key.turn_z};
  for (int a = 0; a < 3; ++a) {
    angle_[a] = {angles_deg_[a], key.angles_deg ? (*key.angles_deg)[a] : angles_deg_[a]};
    if (target_.torque[a]) torque_[a] = {*target_.torque[a], *target_.torque[a]};
    if (!*turns[a]) continue;
    torque_[a] = {target_.torque[a].value_or(torque[a]), (*turns[a])->torque_Nmm};
    target_.torque[a] = torque_[a].from;
  }
}

fem::PressTarget MotionTrack::at(double part, bool with_vibration) {
  const double frames = frame_ - 1 + part;
  const double done = frames / key().frames;
  for (int a = 0; a < 3; ++a) {
    target_.axis[a].value = translation_[a].at(done);
    angles_deg_[a] = angle_[a].at(done);
    if (target_.torque[a]) target_.torque[a] = torque_[a].at(done);
  }
  target_.rotation = rotation_from_xyz(angles_deg_ * kRadiansPerDegree);
  fem::PressTarget there = target_;
  if (with_vibration && key().vibration) {
    const VibrationSpec& vibration = *key().vibration;
    there.axis[static_cast<int>(vibration.axis)].value +=
        vibration.amplitude_mm * std::sin(2.0 * kPi * vibration.frequency_Hz * frames / motion_.frame_rate_Hz);
  }
  return there;
}

}  // namespace touchstone::sim
