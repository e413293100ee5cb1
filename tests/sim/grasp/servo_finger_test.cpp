#include "sim/grasp/servo_finger.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "core/error.h"
#include "core/units.h"
#include "sim/press/gel_setup.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::sim {
namespace {

using ::testing::HasSubstr;

/// A rigid piece of 12 mm on a small pad.
const GrippedFace& face() {
  static const GrippedFace made = [] {
    const test::TemporaryFolder cache;
    const auto device = parse_yaml<DeviceSpec>(R"(
name: small
gel: {size_x_mm: 18, size_y_mm: 12, thickness_mm: 2, youngs_modulus_MPa: 0.25, poisson_ratio: 0.49}
mesh: {fine_mm: 0.6, coarse_mm: 1.8, fine_half_extent_mm: [6.8, 2.7], fine_depth_mm: 0.6}
plate: {thickness_mm: 5, refractive_index: 1.49}
)",
                                               "small.yaml");
    const auto piece = parse_yaml<ObjectSpec>(
        "name: piece\nshape: {type: hexagon, across_flats_mm: 6.5, length_mm: 12}\nfriction: 0.8\n", "piece.yaml");
    GrippedFaceSettings settings;
    settings.largest_force_N = 8.0;
    return GrippedFace(device, *set_up_gel(device, cache.path()), piece, nullptr, {}, settings);
  }();
  return made;
}

ServoFingerSettings still() {
  ServoFingerSettings settings;
  settings.shake_um = 0.0;
  return settings;
}

TEST(ServoFinger, IsAsStiffAsItsComplianceSlopeAtTheLever) {
  // Full torque, 1.5 N m, at 32 steps of 300/1024 degrees from the goal: 9.17 N m a radian, at 70 mm 1.87 N/mm.
  EXPECT_NEAR(servo_stiffness({}), 1.5e3 / (32 * 300.0 / 1024 * kPi / 180) / (70 * 70), 1e-12);
  EXPECT_NEAR(servo_stiffness({}), 1.87, 0.005);
}

TEST(ServoFinger, HoldsTheTargetAsNearlyAsItsStepsAllow) {
  const double step_mm = 70 * 300.0 / 1024 * kPi / 180;
  for (const double target : {0.5, 1.0, 2.0, 3.5}) {
    FingerMotion motion;
    motion.target_force_N = target;
    const FingerRun run = play_servo_finger(face(), still(), motion);
    EXPECT_NEAR(run.static_force_N, target, 0.5 * servo_stiffness({}) * step_mm);
    double held = 0.0;
    for (const FingerMoment& moment : run.moments) {
      EXPECT_GE(moment.force_N, 0.0) << "contact doesn't pull";
      if (moment.seconds < run.release_s - 1e-9) held = moment.force_N;
    }
    EXPECT_NEAR(held, run.static_force_N, 1e-3) << "at the hold's end it has come to rest";
    EXPECT_EQ(run.moments.back().force_N, 0.0);
  }
}

TEST(ServoFinger, RestsClosesHoldsAndOpens) {
  const FingerMotion motion;
  const FingerRun run = play_servo_finger(face(), still(), motion);
  int phase = 0;
  double holding = 0.0;
  for (const FingerMoment& moment : run.moments) {
    EXPECT_GE(static_cast<int>(moment.phase), phase);
    phase = static_cast<int>(moment.phase);
    holding += moment.phase == FingerPhase::holding ? 1e-3 : 0.0;
  }
  EXPECT_EQ(phase, static_cast<int>(FingerPhase::opening));
  EXPECT_NEAR(holding, motion.hold_s, 2e-3);
  EXPECT_GT(run.first_touch_s, motion.rest_s);
  EXPECT_GT(run.apart_s, run.release_s);
  EXPECT_LT(run.apart_s, run.release_s + 0.1);
  EXPECT_EQ(run.moments.front().travel_mm, -motion.clearance_mm);
  EXPECT_NEAR(run.moments.back().travel_mm, -motion.clearance_mm, 0.05) << "back at the start";
}

TEST(ServoFinger, FreeItRingsAtItsFrequency) {
  ServoFingerSettings settings = still();
  settings.damping = 0.01;
  settings.ring_Hz = 25.0;
  FingerMotion motion;
  motion.apart_s = 0.8;
  motion.opening_mm_s = 500.0;
  motion.clearance_mm = 8.0;  // it mustn't touch again
  const FingerRun run = play_servo_finger(face(), settings, motion);
  int turns = 0;
  double first = 0.0;
  double last = 0.0;
  for (std::size_t k = 1; k < run.moments.size(); ++k) {
    const double before = run.moments[k - 1].speed_mm_s;
    const double now = run.moments[k].speed_mm_s;
    if (run.moments[k].seconds < run.release_s + 0.2 || !(before <= 0.0 && now > 0.0)) continue;
    last = run.moments[k].seconds - 1e-3 * now / (now - before);
    if (turns++ == 0) first = last;
  }
  ASSERT_GT(turns, 10);
  EXPECT_NEAR((turns - 1) / (last - first), 25.0, 0.05);
}

TEST(ServoFinger, WithoutLossesEnergyStays) {
  ServoFingerSettings settings = still();
  settings.damping = 0.0;
  settings.loss_s = 0.0;
  settings.time_step_s = 1e-5;
  const FingerRun run = play_servo_finger(face(), settings, {}, 1e-3);
  const double stiffness = servo_stiffness(settings);
  const double mass = stiffness / std::pow(2 * kPi * settings.ring_Hz, 2);
  const double step_mm = settings.lever_mm * settings.step_deg * kRadiansPerDegree;
  // Where the horn stands while it holds: from the balance at the static force.
  double rest = 0.0;
  for (double s = 0.0; s < face().states().back().travel_mm; s += 1e-5) {
    if (face().at_travel(s).force_N <= run.static_force_N) rest = s;
  }
  const double horn = std::round((rest + run.static_force_N / stiffness + 1.0) / step_mm) * step_mm - 1.0;
  const auto energy = [&](const FingerMoment& m) {
    double stored = 0.0;  // the contact's, exact for a force that is linear between its states
    for (std::size_t k = 1; k < face().states().size(); ++k) {
      const GripPoint& low = face().states()[k - 1];
      if (m.travel_mm <= low.travel_mm) break;
      const double end = std::min(m.travel_mm, face().states()[k].travel_mm);
      stored += 0.5 * (low.force_N + face().at_travel(end).force_N) * (end - low.travel_mm);
    }
    return 0.5 * mass * m.speed_mm_s * m.speed_mm_s + 0.5 * stiffness * std::pow(horn - m.travel_mm, 2) + stored;
  };
  double least = 1e9;
  double most = 0.0;
  for (const FingerMoment& m : run.moments) {
    if (m.seconds < run.release_s - 0.5 || m.seconds >= run.release_s) continue;
    least = std::min(least, energy(m));
    most = std::max(most, energy(m));
  }
  EXPECT_LT(most - least, 0.01 * most);
  EXPECT_GT(least, 0.0);
}

TEST(ServoFinger, IsShakenByAsMuchAsAskedFor) {
  ServoFingerSettings settings;
  settings.shake_um = 20.0;
  FingerMotion motion;
  motion.rest_s = 30.0;
  const FingerRun run = play_servo_finger(face(), settings, motion);
  double sum = 0.0;
  int count = 0;
  for (const FingerMoment& m : run.moments) {
    if (m.seconds < 1.0 || m.phase != FingerPhase::resting) continue;
    sum += std::pow(m.travel_mm + motion.clearance_mm, 2);
    ++count;
  }
  // Correlated over 1 / (zeta omega) = 64 ms: 450 independent squares, whose mean scatters by 7 %, its root by 3 %.
  EXPECT_NEAR(std::sqrt(sum / count), 0.020, 0.12 * 0.020);
}

TEST(ServoFinger, TheSameSeedGivesTheSameGrasp) {
  FingerMotion motion;
  const FingerRun one = play_servo_finger(face(), {}, motion);
  const FingerRun two = play_servo_finger(face(), {}, motion);
  motion.shake_seed = 2;
  const FingerRun three = play_servo_finger(face(), {}, motion);
  ASSERT_EQ(one.moments.size(), two.moments.size());
  bool differs = false;
  for (std::size_t k = 0; k < one.moments.size(); ++k) {
    EXPECT_EQ(one.moments[k].travel_mm, two.moments[k].travel_mm);
    EXPECT_EQ(one.moments[k].force_N, two.moments[k].force_N);
    differs = differs || one.moments[k].travel_mm != three.moments[k].travel_mm;
  }
  EXPECT_TRUE(differs);
}

TEST(ServoFinger, WhatItCantDoIsRefused) {
  const auto expect_refused = [](const char* words, const auto& change) {
    ServoFingerSettings settings;
    FingerMotion motion;
    double interval = 1e-3;
    change(settings, motion, interval);
    try {
      play_servo_finger(face(), settings, motion, interval);
      ADD_FAILURE() << "not refused: " << words;
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), HasSubstr(words));
    }
  };
  using S = ServoFingerSettings&;
  using M = FingerMotion&;
  using I = double&;
  expect_refused("the servo stalls at 21.4 N", [](S, M m, I) { m.target_force_N = 22.0; });
  expect_refused("after largest_closing_mm, 1.5 mm", [](S s, M, I) { s.largest_closing_mm = 1.5; });
  expect_refused("more than the 8.28 N", [](S, M m, I) { m.target_force_N = 12.0; });
  expect_refused("target_force_N is 0", [](S, M m, I) { m.target_force_N = 0.0; });
  expect_refused("hold_s is -1", [](S, M m, I) { m.hold_s = -1.0; });
  expect_refused("lever_mm is 0", [](S s, M, I) { s.lever_mm = 0.0; });
  expect_refused("shaken without end", [](S s, M, I) { s.damping = 0.0; });
  expect_refused("whole multiple", [](S, M, I i) { i = 1.234e-4; });
  expect_refused("whole multiple", [](S, M, I i) { i = 1e-6; });
}

}  // namespace
}  // namespace touchstone::sim
