#include "sim/grasp/servo_finger.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/number_checks.h"
#include "core/random.h"
#include "core/units.h"

namespace touchstone::sim {
namespace {

constexpr double kMillimetresPerMetre = 1e3;
constexpr double kShakeStep_s = 1e-3;  // for which a shaking force stays
constexpr double kWhole = 1e-6;        // of a time step: how nearly a whole multiple is one

constexpr const char* kWhose = "the finger's ";  // begins what a refusal says

void check_all(const ServoFingerSettings& s, const FingerMotion& m, double interval_s) {
  check_above_zero(kWhose, s.step_deg, "step_deg");
  check_above_zero(kWhose, s.stall_torque_Nm, "stall_torque_Nm");
  check_above_zero(kWhose, s.slope_steps, "slope_steps");
  check_above_zero(kWhose, s.lever_mm, "lever_mm");
  check_above_zero(kWhose, s.lag_s, "lag_s");
  check_above_zero(kWhose, s.ring_Hz, "ring_Hz");
  check_at_least_zero(kWhose, s.damping, "damping");
  check_at_least_zero(kWhose, s.loss_s, "loss_s");
  check_at_least_zero(kWhose, s.shake_um, "shake_um");
  check_above_zero(kWhose, s.largest_closing_mm, "largest_closing_mm");
  check_above_zero(kWhose, s.time_step_s, "time_step_s");
  check_at_least_zero(kWhose, m.clearance_mm, "clearance_mm");
  check_above_zero(kWhose, m.target_force_N, "target_force_N");
  check_above_zero(kWhose, m.closing_mm_s, "closing_mm_s");
  check_above_zero(kWhose, m.opening_mm_s, "opening_mm_s");
  check_at_least_zero(kWhose, m.hold_s, "hold_s");
  check_at_least_zero(kWhose, m.rest_s, "rest_s");
  check_at_least_zero(kWhose, m.apart_s, "apart_s");
  const double steps = interval_s / s.time_step_s;
  if (!(steps >= 1.0 - kWhole) || std::abs(steps - std::round(steps)) > kWhole * steps) {
    fail("moments of a grasp every {} s: that must be a whole multiple of time_step_s, {}", interval_s, s.time_step_s);
  }
  if (s.damping == 0.0 && s.shake_um > 0.0) fail("a finger without damping would be shaken without end");
}

/// Where the finger rests when the horn is at `horn` beyond the touch.
GripPoint at_rest(const GrippedFace& face, double stiffness, double horn) {
  if (horn <= 0.0) return face.at_travel(horn);
  double low = 0.0;
  double high = std::min(horn, face.states().back().travel_mm);
  if (stiffness * (horn - high) > face.at_travel(high).force_N) {
    fail("the finger would press with more than the {:.3g} N that the face was solved for",
         face.states().back().force_N);
  }
  for (int k = 0; k < 60; ++k) {
    const double middle = 0.5 * (low + high);
    (stiffness * (horn - middle) > face.at_travel(middle).force_N ? low : high) = middle;
  }
  return face.at_travel(0.5 * (low + high));
}

/// How many steps close the finger to the target, and the force there.
std::pair<int, double> closing_steps(const GrippedFace& face, const ServoFingerSettings& s, const FingerMotion& motion,
                                     double step_mm, double stiffness) {
  const double stall_N = s.stall_torque_Nm / (s.lever_mm / kMillimetresPerMetre);
  double before = 0.0;
  for (int steps = 1;; ++steps) {
    const double closed = steps * step_mm;
    if (closed > s.largest_closing_mm) {
      fail("a force of {:.3g} N is wanted, the finger reaches {:.3g} N after largest_closing_mm, {} mm",
           motion.target_force_N, before, s.largest_closing_mm);
    }
    const double force = at_rest(face, stiffness, closed - motion.clearance_mm).force_N;
    if (std::max(force, motion.target_force_N) > stall_N) {
      fail("a force of {:.3g} N is wanted, the servo stalls at {:.3g} N", motion.target_force_N, stall_N);
    }
    if (force >= motion.target_force_N) {
      const bool nearer_before = motion.target_force_N - before < force - motion.target_force_N && before > 0.0;
      return nearer_before ? std::pair{steps - 1, before} : std::pair{steps, force};
    }
    before = force;
  }
}

}  // namespace

double servo_stiffness(const ServoFingerSettings& s) {
  const double per_radian = s.stall_torque_Nm / (s.slope_steps * s.step_deg * kRadiansPerDegree);  // N m
  return per_radian * kMillimetresPerMetre / (s.lever_mm * s.lever_mm);
}

FingerRun play_servo_finger(const GrippedFace& face, const ServoFingerSettings& settings, const FingerMotion& motion,
                            double interval_s) {
  check_all(settings, motion, interval_s);
  const double step_mm = settings.lever_mm * settings.step_deg * kRadiansPerDegree;
  const double stiffness = servo_stiffness(settings);
  const double ring = 2.0 * kPi * settings.ring_Hz;
  const double mass = stiffness / (ring * ring);  // tonnes
  const double friction = 2.0 * settings.damping * mass * ring;
  // White noise of the spectral density that moves the free finger by shake_um (Crandall's sigma^2 = pi S / (2 zeta
  // omega^3 m^2)), held constant for kShakeStep_s.
  const double shake_N = settings.shake_um / kMicrometresPerMillimetre * stiffness *
                         std::sqrt(4.0 * settings.damping / (ring * kShakeStep_s));

  FingerRun run;
  const auto [steps, static_force] = closing_steps(face, settings, motion, step_mm, stiffness);
  run.static_force_N = static_force;
  const double closed_s = motion.rest_s + (steps - 1) * step_mm / motion.closing_mm_s;
  run.release_s = closed_s + motion.hold_s;
  const double end_s = run.release_s + motion.apart_s;

  const double dt = settings.time_step_s;
  const auto every = static_cast<long>(std::lround(interval_s / dt));
  const auto shake_every = std::max(1L, std::lround(kShakeStep_s / dt));
  const double follow = 1.0 - std::exp(-dt / settings.lag_s);
  RandomStream numbers(motion.shake_seed, 0, Purpose::kGraspShake);
  double horn = -motion.clearance_mm;
  double travel = horn;
  double speed = 0.0;
  double acceleration = 0.0;
  double shake = 0.0;
  bool touched = false;
  for (long k = 0;; ++k) {
    const double now = static_cast<double>(k) * dt;
    FingerPhase phase = FingerPhase::resting;
    int commanded = 0;
    if (now >= run.release_s) {
      phase = FingerPhase::opening;
      const double opened = std::floor((now - run.release_s) * motion.opening_mm_s / step_mm) + 1.0;
      commanded = std::max(0, steps - static_cast<int>(std::min<double>(opened, steps)));
    } else if (now >= motion.rest_s) {
      phase = now < closed_s ? FingerPhase::closing : FingerPhase::holding;
      const double due = std::floor((now - motion.rest_s) * motion.closing_mm_s / step_mm) + 1.0;
      commanded = static_cast<int>(std::min<double>(due, steps));
    }
    if (k % shake_every == 0 && shake_N > 0.0) shake = shake_N * numbers.normal();

    const GripPoint point = face.at_travel(travel);
    const double contact = std::max(0.0, point.force_N + settings.loss_s * point.stiffness_N_mm * speed);
    const double goal = commanded * step_mm - motion.clearance_mm;
    const double horn_speed = follow / dt * (goal - horn);
    acceleration = (stiffness * (horn - travel) + friction * (horn_speed - speed) - contact + shake) / mass;
    if (point.force_N > 0.0) {
      if (!touched) run.first_touch_s = now;
      touched = true;
      run.apart_s = now;
    }
    if (k % every == 0) run.moments.push_back({now, travel, speed, acceleration, contact, phase});
    if (now >= end_s) break;
    // Symplectic: a finger without damping neither gains nor loses.
    speed += acceleration * dt;
    travel += speed * dt;
    horn += follow * (goal - horn);
  }
  return run;
}

}  // namespace touchstone::sim
