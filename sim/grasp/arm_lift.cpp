#include "sim/grasp/arm_lift.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/number_checks.h"

namespace touchstone::sim {
namespace {}  // namespace

void check(const ArmLiftSettings& settings) {
  check_above_zero("", settings.height_mm, "the lift's height_mm");
  check_above_zero("", settings.speed_mm_s, "the lift's speed_mm_s");
  check_above_zero("", settings.acceleration_mm_s2, "the lift's acceleration_mm_s2");
}

ArmLift::ArmLift(const ArmLiftSettings& settings) : settings_(settings) {
  check(settings);
  // A short lift never reaches the speed.
  settings_.speed_mm_s = std::min(settings.speed_mm_s, std::sqrt(settings.height_mm * settings.acceleration_mm_s2));
}

double ArmLift::ramp() const {
  return settings_.speed_mm_s / settings_.acceleration_mm_s2;
}

double ArmLift::total() const {
  return settings_.height_mm / settings_.speed_mm_s + ramp();
}

double ArmLift::planned_speed(double time) const {
  const double from_end = std::min(time, total() - time);
  return std::clamp(settings_.acceleration_mm_s2 * from_end, 0.0, settings_.speed_mm_s);
}

double ArmLift::next(bool lift, double seconds) {
  TS_ASSERT(seconds > 0.0);
  const double before = speed_;
  aborted_ = aborted_ || (!lift && time_ > 0.0);
  if (aborted_) {
    speed_ = std::max(0.0, speed_ - settings_.acceleration_mm_s2 * seconds);
  } else if (lift) {
    time_ += seconds;
    speed_ = planned_speed(time_);
  }
  return (speed_ - before) / seconds;
}

bool ArmLift::done() const {
  return !aborted_ && time_ >= total();
}

}  // namespace touchstone::sim
