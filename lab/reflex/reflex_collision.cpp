#include "lab/reflex/reflex_collision.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/number_checks.h"

namespace touchstone::lab {
namespace {

constexpr const char* kWhose = "collision: ";  // begins what a refusal says

void check(const CollisionSettings& s) {
  check_above_zero(kWhose, s.actuator.mass_kg, "mass_kg");
  check_above_zero(kWhose, s.actuator.most_acceleration_mm_s2, "most_acceleration_mm_s2");
  check_above_zero(kWhose, s.actuator.velocity_gain_per_s, "velocity_gain_per_s");
  check_above_zero(kWhose, s.speed_mm_s, "speed_mm_s");
  check_above_zero(kWhose, s.frame_s, "frame_s");
  check_above_zero(kWhose, s.most_press_mm, "most_press_mm");
  check_above_zero(kWhose, s.longest_s, "longest_s");
  check_above_zero(kWhose, s.step_s, "step_s");
  for (const auto& [value, name] : {std::pair{s.actuator.bus_s, "bus_s"}, std::pair{s.gap_mm, "gap_mm"},
                                    std::pair{s.first_frame_s, "first_frame_s"}}) {
    if (!(value >= 0.0) || !std::isfinite(value)) fail("collision: {} is {}, it must be at least 0", name, value);
  }
}

}  // namespace

std::optional<double> Collision::reaction_ms() const {
  if (!brake_s) return {};
  return 1e3 * (*brake_s - touch_s);
}

Collision play_collision(const CollisionSettings& settings, const PlateForce& force, const StopWatch& watch) {
  constexpr double kStandstill_mm_s = 1e-6;
  constexpr double kMmPerM = 1e3;
  check(settings);
  const ActuatorSettings& actuator = settings.actuator;
  Collision result;
  result.touch_s = settings.gap_mm / settings.speed_mm_s;
  double press_mm = -settings.gap_mm, speed_mm_s = settings.speed_mm_s;
  double integral_mm = 0.0;
  bool was_braking = false;
  std::int64_t frames = 0;
  const double step_s = settings.step_s;
  for (std::int64_t step = 0;; ++step) {
    const double t_s = static_cast<double>(step) * step_s;
    if (t_s > settings.longest_s) return result;
    while (settings.first_frame_s + static_cast<double>(frames) * settings.frame_s <= t_s) {
      const double asked_s = settings.first_frame_s + static_cast<double>(frames++) * settings.frame_s;
      // Between two steps the path is straight to far below what matters here.
      const std::optional<double> sent_s = watch(asked_s, press_mm - (t_s - asked_s) * speed_mm_s);
      if (!sent_s || result.stop_sent_s) continue;
      if (*sent_s < asked_s) fail("collision: a stop sent at {} s, before it was asked for at {} s", *sent_s, asked_s);
      result.stop_sent_s = sent_s;
      result.brake_s = *sent_s + actuator.bus_s;
    }
    const double plate_N = press_mm > 0.0 ? force(t_s, press_mm) : 0.0;
    result.peak_force_N = std::max(result.peak_force_N, plate_N);
    result.peak_press_mm = std::max(result.peak_press_mm, press_mm);
    if (press_mm > settings.most_press_mm) {
      result.beyond_law = true;
      return result;
    }
    const bool braking = result.brake_s && t_s >= *result.brake_s;
    if (braking && speed_mm_s <= kStandstill_mm_s) {
      result.standstill_s = t_s;
      return result;
    }
    if (braking && !was_braking) integral_mm = 0.0;
    was_braking = braking;
    const double off_mm_s = (braking ? 0.0 : settings.speed_mm_s) - speed_mm_s;
    const double gain_per_s = actuator.velocity_gain_per_s;
    const double most_mm_s2 = actuator.most_acceleration_mm_s2;
    const double asked_mm_s2 = gain_per_s * off_mm_s + 0.25 * gain_per_s * gain_per_s * integral_mm;
    const double motor_mm_s2 = std::clamp(asked_mm_s2, -most_mm_s2, most_mm_s2);
    if (motor_mm_s2 == asked_mm_s2) integral_mm += step_s * off_mm_s;  // no winding up at the motor's end
    const double plate_mm_s2 = kMmPerM * plate_N / actuator.mass_kg;
    // Midpoint in the position, explicit in the velocity: the force hardly changes in a step of 10 us.
    const double next_mm_s = speed_mm_s + step_s * (motor_mm_s2 - plate_mm_s2);
    press_mm += 0.5 * step_s * (speed_mm_s + next_mm_s);
    speed_mm_s = next_mm_s;
    // Without a stop the motor and the plate come to terms: nothing moves any more.
    if (!result.brake_s && press_mm > 0.0 && std::abs(speed_mm_s) < kStandstill_mm_s &&
        std::abs(motor_mm_s2 - plate_mm_s2) < kStandstill_mm_s) {
      return result;
    }
  }
}

}  // namespace touchstone::lab
