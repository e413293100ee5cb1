#include "lab/reflex/reflex_collision.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/error.h"

namespace touchstone::lab {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

const PlateForce kNoForce = [](double, double) { return 0.0; };
const StopWatch kNobody = [](double, double) { return std::optional<double>(); };

double text_law(double, double press_mm) {
  return 1.1293 * std::expm1(0.4677 * press_mm);
}

TEST(ReflexCollision, WithoutForceTheBrakingDistanceIsThatOfTheBrake) {
  CollisionSettings settings;
  settings.speed_mm_s = 100.0;
  settings.gap_mm = 5.0;
  settings.first_frame_s = 2e-4;
  settings.actuator.velocity_gain_per_s = 1e4;  // braking is at its most until the very end
  const StopWatch at_once = [&](double t_s, double press_mm) {
    return press_mm > 0.0 ? std::optional(t_s) : std::nullopt;
  };
  const Collision run = play_collision(settings, kNoForce, at_once);
  const double travelled_until_brake_mm = 100.0 * (*run.brake_s - run.touch_s);
  const double braking_mm = 100.0 * 100.0 / (2.0 * 20000.0);
  EXPECT_NEAR(run.peak_press_mm, travelled_until_brake_mm + braking_mm, 0.01);
  EXPECT_NEAR(run.touch_s, 0.05, 1e-12);
  // Touch within a frame, sent at its end, a millisecond of bus.
  EXPECT_GT(*run.reaction_ms(), 1.0);
  EXPECT_LE(*run.reaction_ms(), 1.0 + 1e3 / 1500.0 + 1e-9);
  EXPECT_EQ(run.peak_force_N, 0.0);
  EXPECT_FALSE(run.beyond_law);
}

TEST(ReflexCollision, AFreeMassGivesItsEnergyToASpring) {
  CollisionSettings settings;
  settings.actuator.most_acceleration_mm_s2 = 1e-9;  // a motor that does nothing
  settings.speed_mm_s = 50.0;
  settings.longest_s = 0.2;
  const double stiffness_N_mm = 1.0;
  const Collision run = play_collision(
      settings, [&](double, double press_mm) { return stiffness_N_mm * press_mm; }, kNobody);
  // m v^2 = k x^2, with 0.5 kg and 50 mm/s: 1.118 N at 1.118 mm
  EXPECT_NEAR(run.peak_force_N, 0.05 * std::sqrt(0.5 * 1e3), 2e-3);
  EXPECT_NEAR(run.peak_press_mm, run.peak_force_N / stiffness_N_mm, 1e-6);
  EXPECT_FALSE(run.brake_s);
  EXPECT_FALSE(run.reaction_ms());
}

TEST(ReflexCollision, AnEarlierStopHurtsLess) {
  std::vector<double> peaks;
  for (const double late_s : {0.0, 0.002, 0.010, 0.050}) {
    CollisionSettings settings;
    settings.speed_mm_s = 30.0;
    const Collision run = play_collision(settings, text_law, [&](double t_s, double press_mm) {
      return press_mm > 0.0 ? std::optional(t_s + late_s) : std::nullopt;
    });
    EXPECT_TRUE(run.standstill_s);
    EXPECT_FALSE(run.beyond_law);
    peaks.push_back(run.peak_force_N);
  }
  for (std::size_t i = 1; i < peaks.size(); ++i) EXPECT_GT(peaks[i], peaks[i - 1]);
  EXPECT_LT(peaks[0], 0.2);
}

TEST(ReflexCollision, WhoIsNotStoppedEndsWhereTheMotorAndThePlateComeToTerms) {
  CollisionSettings settings;
  settings.actuator.most_acceleration_mm_s2 = 2000.0;  // 1 N of 0.5 kg
  settings.speed_mm_s = 5.0;
  const Collision run = play_collision(settings, text_law, kNobody);
  EXPECT_FALSE(run.stop_sent_s);
  EXPECT_FALSE(run.beyond_law);
  // 1 N, and what the mass's speed adds where the plate's stiffness is 0.4677 (1.1293 + 1) N/mm: v sqrt(k m).
  const double stiffness_N_m = 1e3 * 0.4677 * (1.1293 + 1.0);
  EXPECT_NEAR(run.peak_force_N, 1.0 + 0.005 * std::sqrt(stiffness_N_m * 0.5), 0.01);
  settings.actuator.most_acceleration_mm_s2 = 1e5;  // 50 N
  const Collision strong = play_collision(settings, text_law, kNobody);
  EXPECT_TRUE(strong.beyond_law);
  EXPECT_GT(strong.peak_press_mm, 5.0);
}

TEST(ReflexCollision, HalfAStepIsTheSame) {
  CollisionSettings settings;
  settings.first_frame_s = 3e-4;
  const StopWatch watch = [](double t_s, double press_mm) {
    return press_mm > 0.1 ? std::optional(t_s + 5e-4) : std::nullopt;
  };
  const Collision coarse = play_collision(settings, text_law, watch);
  settings.step_s *= 0.5;
  const Collision fine = play_collision(settings, text_law, watch);
  EXPECT_NEAR(coarse.peak_force_N, fine.peak_force_N, 1e-3 * fine.peak_force_N);  // the brake begins with a step
  EXPECT_NEAR(*coarse.reaction_ms(), *fine.reaction_ms(), 1e-6);
}

TEST(ReflexCollision, AFalseAlarmIsBeforeTheTouch) {
  const Collision run = play_collision({}, text_law, [](double t_s, double) { return std::optional(t_s); });
  EXPECT_LT(*run.reaction_ms(), 0.0);
  EXPECT_EQ(run.peak_force_N, 0.0);
}

TEST(ReflexCollision, WhatMakesNoSenseIsNamed) {
  const auto with = [](auto change) {
    return [change] {
      CollisionSettings settings;
      change(settings);
      play_collision(settings, kNoForce, kNobody);
    };
  };
  using S = CollisionSettings;
  EXPECT_THAT(with([](S& s) { s.actuator.mass_kg = 0.0; }), ThrowsMessage<Error>(HasSubstr("mass_kg is 0")));
  EXPECT_THAT(with([](S& s) { s.speed_mm_s = -1.0; }), ThrowsMessage<Error>(HasSubstr("speed_mm_s is -1")));
  EXPECT_THAT(with([](S& s) { s.gap_mm = -1.0; }), ThrowsMessage<Error>(HasSubstr("gap_mm is -1")));
  EXPECT_THAT(with([](S& s) { s.step_s = std::nan(""); }), ThrowsMessage<Error>(HasSubstr("step_s")));
  EXPECT_THAT([] { play_collision({}, kNoForce, [](double t_s, double) { return std::optional(t_s - 1.0); }); },
              ThrowsMessage<Error>(HasSubstr("before it was asked for")));
}

}  // namespace
}  // namespace touchstone::lab
