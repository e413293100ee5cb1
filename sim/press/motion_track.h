#pragma once
// One object's path along its motion, as targets of a press.

#include <Eigen/Core>
#include <array>
#include <optional>

#include "fem/contact/press.h"
#include "sim/scene/motion.h"

namespace touchstone::sim {

/// Follows the keys frame by frame: positions, forces, angles and torques run linearly over each key from what held
/// when it began.
class MotionTrack {
 public:
  /// The motion must outlive this.
  explicit MotionTrack(const MotionSpec& motion);

  /// The target of frame 0.
  fem::PressTarget start() const { return target_; }

  /// Goes on to the next frame; `now` is the object as the last one left it.
  /// @pre the motion has such a frame
  void next_frame(const fem::BodyState& now);

  /// The key that the frame belongs to. @pre next_frame was called
  const MotionKey& key() const;
  /// Time since the key began, at the end of the frame, s.
  double seconds_in_key() const;

  /// Where the object shall be after this part (0 to 1] of the frame, without the time that it takes.
  /// @param with_vibration the key's vibration is added to the position
  fem::PressTarget at(double part, bool with_vibration);

 private:
  /// What an axis is led to over the frames of a key.
  struct Ramp {
    double from = 0.0;
    double to = 0.0;
    double at(double part) const { return from + part * (to - from); }
  };
  void begin_key(const MotionKey& key, const fem::BodyState& now);

  const MotionSpec& motion_;
  int next_key_ = 0;
  int frame_ = 0;  // of the key, from 1
  fem::PressTarget target_;
  Eigen::Vector3d angles_deg_;
  std::array<Ramp, 3> translation_, angle_, torque_;
};

}  // namespace touchstone::sim
