#pragma once
// How a robot's arm goes up: with a constant acceleration, at a constant speed, and to a stop.

namespace touchstone::sim {

/// How far and how fast the arm goes up; it also stops with this acceleration.
struct ArmLiftSettings {
  double height_mm = 10.0;
  double speed_mm_s = 5.0;
  double acceleration_mm_s2 = 20.0;
};

/// @throws Error for a setting that isn't above zero and finite
void check(const ArmLiftSettings& settings);

/// The arm stands until it is first commanded to lift, and stops with the same acceleration where it isn't any longer.
class ArmLift {
 public:
  /// An arm that stands at height 0. @throws Error as check()
  explicit ArmLift(const ArmLiftSettings& settings);

  /// The mean acceleration (mm/s^2, up) over the next `seconds`.
  double next(bool lift, double seconds);

  double speed_mm_s() const { return speed_; }
  bool done() const;  ///< at its height, and standing

 private:
  double planned_speed(double time) const;
  double ramp() const;
  double total() const;

  ArmLiftSettings settings_;
  double time_ = 0.0;  // since the start of the lift
  double speed_ = 0.0;
  bool aborted_ = false;
};

}  // namespace touchstone::sim
