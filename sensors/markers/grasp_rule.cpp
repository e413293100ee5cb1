#include "sensors/markers/grasp_rule.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/number_checks.h"

namespace touchstone::sensors {
namespace {

constexpr double kLeastStep_mm = 1e-9;  // what sums of steps leave of a limit by rounding

void check_at_least(int value, int least, const char* name) {
  if (value < least) fail("{} is {}, it must be at least {}", name, value, least);
}

}  // namespace

void check(const GraspRuleSettings& s) {
  check_above_zero("", s.touch_height_mm, "touch_height_mm");
  check_at_least(s.touch_frames, 1, "touch_frames");
  check_above_zero("", s.approach_step_mm, "approach_step_mm");
  check_above_zero("", s.longest_approach_mm, "longest_approach_mm");
  check_above_zero("", s.slip_step_mm, "slip_step_mm");
  check_at_least(s.settle_frames, 0, "settle_frames");
  if (!(s.most_slip_travel_mm >= 0.0) || !std::isfinite(s.most_slip_travel_mm)) {
    fail("most_slip_travel_mm is {}, it must be at least 0 and finite", s.most_slip_travel_mm);
  }
  if (s.most_normal_force_N) check_above_zero("", *s.most_normal_force_N, "most_normal_force_N");
  if (!(s.lost_height_mm >= 0.0) || !(s.lost_height_mm < s.touch_height_mm)) {
    fail("lost_height_mm is {}, it must be from 0 to below touch_height_mm, {}", s.lost_height_mm, s.touch_height_mm);
  }
  check_at_least(s.lost_frames, 1, "lost_frames");
}

std::string name_of(GraspPhase phase) {
  switch (phase) {
    case GraspPhase::approaching:
      return "approaching";
    case GraspPhase::touched:
      return "touched";
    case GraspPhase::lifting:
      return "lifting";
    case GraspPhase::holding:
      return "holding";
    case GraspPhase::nothing_there:
      return "nothing there";
    case GraspPhase::slipping:
      return "slipping";
    case GraspPhase::lost:
      return "lost";
  }
  TS_ASSERT(false);
  return {};
}

bool has_ended_badly(GraspPhase phase) {
  return phase == GraspPhase::nothing_there || phase == GraspPhase::slipping || phase == GraspPhase::lost;
}

GraspRule::GraspRule(const GraspRuleSettings& settings) : settings_(settings) {
  check(settings);
}

GraspCommand GraspRule::next(const GraspReading& reading) {
  if (!std::isfinite(reading.height_max_mm)) fail("the height map's maximum is {} mm", reading.height_max_mm);
  if (reading.normal_force_N && !std::isfinite(*reading.normal_force_N)) {
    fail("the estimated normal force is {} N", *reading.normal_force_N);
  }
  if (has_ended_badly(phase_)) return {phase_, 0.0, false};
  if (phase_ == GraspPhase::approaching || phase_ == GraspPhase::touched) return approach(reading);
  return lift(reading);
}

GraspCommand GraspRule::end(GraspPhase phase) {
  phase_ = phase;
  return {phase_, 0.0, false};
}

GraspCommand GraspRule::approach(const GraspReading& reading) {
  touching_ = reading.height_max_mm > settings_.touch_height_mm ? touching_ + 1 : 0;
  if (touching_ >= settings_.touch_frames) {
    phase_ = GraspPhase::lifting;
    return {phase_, 0.0, true};
  }
  if (touching_ > 0) {
    phase_ = GraspPhase::touched;
    return {phase_, 0.0, false};
  }
  if (approached_ + settings_.approach_step_mm > settings_.longest_approach_mm + kLeastStep_mm)
    return end(GraspPhase::nothing_there);
  phase_ = GraspPhase::approaching;
  approached_ += settings_.approach_step_mm;
  return {phase_, settings_.approach_step_mm, false};
}

GraspCommand GraspRule::lift(const GraspReading& reading) {
  missing_ = reading.height_max_mm < settings_.lost_height_mm ? missing_ + 1 : 0;
  if (missing_ >= settings_.lost_frames) return end(GraspPhase::lost);
  calm_ = reading.lifted && !reading.slip ? calm_ + 1 : 0;
  const bool settled = settling_ == 0;
  settling_ = std::max(0, settling_ - 1);
  if (reading.slip && settled && settings_.react_to_slip) return tighten(reading);
  // Slip that isn't answered yet takes an object out of the state of being held, too.
  phase_ = calm_ > settings_.settle_frames ? GraspPhase::holding : GraspPhase::lifting;
  return {phase_, 0.0, true};
}

GraspCommand GraspRule::tighten(const GraspReading& reading) {
  const double step = std::min(settings_.slip_step_mm, settings_.most_slip_travel_mm - tightened_);
  const bool too_strong = settings_.most_normal_force_N && reading.normal_force_N >= settings_.most_normal_force_N;
  if (step < kLeastStep_mm || too_strong) return end(GraspPhase::slipping);
  tightened_ += step;
  ++answers_;
  settling_ = settings_.settle_frames;
  phase_ = GraspPhase::lifting;
  return {phase_, step, true};
}

}  // namespace touchstone::sensors
