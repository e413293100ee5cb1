#pragma once
// What a reflex is for: an actuator drives the fingertip at a plate that nobody expected, and something tells it to
// stop.

#include <functional>
#include <optional>
#include <string>

namespace touchstone::lab {

/// A mass whose velocity is controlled: a linear axis, or a finger as its joint sees it.
struct ActuatorSettings {
  double mass_kg = 0.5;
  /// What its motor can do, in mm/s^2 of this mass: brakes and drives are both held to it.
  double most_acceleration_mm_s2 = 20000.0;
  /// Proportional gain of the velocity's control, so a lag of 2 ms; its integral's is a quarter of the square, which
  /// damps it critically. The integral starts anew with a brake.
  double velocity_gain_per_s = 500.0;
  /// From a stop command's sending to where the drive brakes: a frame on a serial bus and the drive's own clock.
  double bus_s = 1e-3;
};

/// The plate's force on the fingertip, N, at a time since the start and a press; asked for in order of time, once a
/// step, so that it may have a memory (stress relaxation). No press, no force.
using PlateForce = std::function<double(double t_s, double press_mm)>;

/// The observer: asked at the end of each of the chip's frames with the true press (negative: the gap that is left).
/// Gives the time at which a stop is sent, not before it was asked, or nothing.
using StopWatch = std::function<std::optional<double>(double t_s, double press_mm)>;

/// How the actuator comes, and when the run ends.
struct CollisionSettings {
  ActuatorSettings actuator;
  double speed_mm_s = 20.0;
  double gap_mm = 1.0;  ///< to the plate at the start
  double frame_s = 1.0 / 1500.0;
  double first_frame_s = 0.0;  ///< the first frame's end: the plate comes when it likes
  double most_press_mm = 5.0;  ///< beyond this no law is known: the run ends and says so
  double longest_s = 10.0;
  double step_s = 1e-5;
};

/// One run, with the truth.
struct Collision {
  double touch_s = 0.0;                ///< truth
  std::optional<double> stop_sent_s;   ///< the first stop's
  std::optional<double> brake_s;       ///< where it reaches the drive
  std::optional<double> standstill_s;  ///< where the mass no longer moves on
  double peak_force_N = 0.0;
  double peak_press_mm = 0.0;
  bool beyond_law = false;  ///< the press went over most_press_mm: the peak is more than what is reported

  /// From the touch to the drive's braking; below 0 for a false alarm. Nothing if there was no stop.
  std::optional<double> reaction_ms() const;
};

/// @throws Error that names a setting that makes no sense, and for a stop sent before it was asked for
Collision play_collision(const CollisionSettings& settings, const PlateForce& force, const StopWatch& watch);

}  // namespace touchstone::lab
