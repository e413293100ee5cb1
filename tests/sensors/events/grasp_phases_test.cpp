#include "sensors/events/grasp_phases.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/random.h"
#include "sensors/events/grasp_sequence.h"
#include "tests/sensors/events/synthetic_grasps.h"
#include "tests/support/message_of.h"

namespace touchstone::sensors {
namespace {

using test::message_of;
using testing::ElementsAre;
using testing::HasSubstr;

// Reference: scipy.stats.binom.sf(c - 1, N + c, 1 / 21), least c below the rate.
TEST(BurstThreshold, IsThatOfTheBinomialTest) {
  const auto threshold = [](std::int64_t total, double rate) {
    std::vector<std::int64_t> background(20, total / 20);
    return burst_threshold(background, rate);
  };
  EXPECT_EQ(threshold(0, 1e-6), 5);
  EXPECT_EQ(threshold(20, 1e-6), 10);
  EXPECT_EQ(threshold(1000, 1e-6), 89);
  EXPECT_EQ(threshold(1000, 1e-2), 69);
  EXPECT_EQ(threshold(200'000, 1e-6), 10'492);
}

TEST(BurstThreshold, FalseAlarmsAreAsRareAsAsked) {
  // 20,000 backgrounds, each with one more window of the same rate: 1 % of alarms asked. The test is exact, so at most
  // that (discrete counts, and the division by the scatter, make it fewer); 3.5 standard deviations of the count.
  for (const double mean : {0.3, 5.0, 80.0}) {
    int alarms = 0;
    constexpr int kTrials = 20'000;
    for (int trial = 0; trial < kTrials; ++trial) {
      RandomStream random(3, static_cast<std::uint64_t>(trial), Purpose::kTest);
      std::vector<std::int64_t> background(20);
      for (std::int64_t& count : background) count = static_cast<std::int64_t>(random.poisson(mean));
      alarms += random.poisson(mean) >= static_cast<double>(burst_threshold(background, 0.01));
    }
    EXPECT_LT(alarms, 0.01 * kTrials + 3.5 * std::sqrt(0.01 * kTrials)) << mean;
    EXPECT_GT(alarms, 0) << mean;
  }
}

TEST(BurstThreshold, ScatterBeyondPoissonsRaisesIt) {
  const std::vector<std::int64_t> calm(20, 50);
  std::vector<std::int64_t> wild;
  for (int i = 0; i < 20; ++i) wild.push_back(i % 2 == 0 ? 0 : 100);
  // Variance over mean is 52.6: standard deviations are 7.3 times as large.
  const auto above = [](std::int64_t threshold) { return static_cast<double>(threshold - 50); };
  EXPECT_GT(above(burst_threshold(wild, 1e-6)), 6.0 * above(burst_threshold(calm, 1e-6)));
}

TEST(GraspPhases, OfSyntheticGrasps) {
  for (int i = 0; i < 20; ++i) {
    const SyntheticGrasp grasp = synthetic_grasp(i, i % 4);
    const GraspPhases phases = find_grasp_phases(grasp.windows);
    EXPECT_EQ(phases.first_touch, grasp.first_touch);
    EXPECT_EQ(phases.hold_begin, grasp.first_touch + 22);
    EXPECT_EQ(phases.release_begin, grasp.release);
    EXPECT_EQ(phases.release_end, grasp.release + 22);
    EXPECT_GE(grasp.windows[static_cast<std::size_t>(phases.first_touch)].off, phases.touch_threshold);
    EXPECT_GE(grasp.windows[static_cast<std::size_t>(phases.release_begin)].on, phases.release_threshold);
  }
}

TEST(GraspPhases, WhatIsMissingIsSaid) {
  const auto message = [](std::span<const EventCounts> windows, const GraspPhaseSettings& settings = {}) {
    return message_of([&] { find_grasp_phases(windows, settings); });
  };
  const SyntheticGrasp grasp = synthetic_grasp(0, 0);
  const std::span<const EventCounts> all(grasp.windows);
  EXPECT_EQ(message(all), "no error");
  EXPECT_THAT(message(all.first(20)), HasSubstr("20 windows; more than the 20"));
  EXPECT_THAT(message(all.first(30)), HasSubstr("no touch"));
  EXPECT_THAT(message(all.first(60)), HasSubstr("after the touch in window 30 the recording has 30 windows"));
  EXPECT_THAT(message(all.first(150)), HasSubstr("no release: no window from 72 to 149"));
  EXPECT_THAT(message(all.first(160)), HasSubstr("begins in window 152 and the recording ends 8 windows later"));
  EXPECT_THAT(message(std::vector<EventCounts>(100)), HasSubstr("no touch"));
  // A burst has as many events as are asked for at least.
  GraspPhaseSettings many;
  many.least_events = 1'000'000;
  EXPECT_THAT(message(all, many), HasSubstr("1000000 OFF events"));
}

TEST(GraspPhases, FaultySettingsAreNamed) {
  const std::vector<EventCounts> windows(100);
  const auto message = [&](auto spoil) {
    GraspPhaseSettings settings;
    spoil(settings);
    return message_of([&] { find_first_touch(windows, settings); });
  };
  EXPECT_EQ(message([](auto&) {}), "no error");
  EXPECT_THAT(message([](auto& s) { s.background_windows = 1; }), HasSubstr("background_windows is 1"));
  EXPECT_THAT(message([](auto& s) { s.false_alarm = 0.0; }), HasSubstr("false_alarm is 0"));
  EXPECT_THAT(message([](auto& s) { s.false_alarm = std::nan(""); }), HasSubstr("false_alarm is nan"));
  EXPECT_THAT(message([](auto& s) { s.least_events = 0; }), HasSubstr("least_events is 0"));
  EXPECT_THAT(message([](auto& s) { s.grasp_windows = 0; }), HasSubstr("grasp_windows is 0"));
  EXPECT_THAT(message([](auto& s) { s.least_hold_windows = 19; }), HasSubstr("least_hold_windows is 19"));
  EXPECT_THAT(message([](auto& s) { s.release_windows = 0; }), HasSubstr("release_windows is 0"));
}

TEST(GraspSequence, AccumulatesThroughTheHoldOrSkipsIt) {
  std::vector<EventCounts> windows;
  for (int i = 0; i < 8; ++i) windows.push_back({i, 10 * i});
  const GraspPhases phases{.first_touch = 1, .hold_begin = 3, .release_begin = 5, .release_end = 7};
  const GraspSequence through = grasp_sequence(windows, phases, 7000);
  ASSERT_EQ(through.counts.rows(), 6);
  EXPECT_EQ(through.counts.col(0), (Eigen::VectorXd(6) << 1, 3, 6, 10, 15, 21).finished());
  EXPECT_EQ(through.counts.col(1), 10.0 * through.counts.col(0));
  EXPECT_THAT(through.judged, ElementsAre(0, 1, 4, 5));
  EXPECT_EQ(through.grasp_windows, 2);
  EXPECT_DOUBLE_EQ(through.time_s[0], 0.007);
  EXPECT_DOUBLE_EQ(through.time_s[5], 0.042);
  const GraspSequence skipping = grasp_sequence(windows, phases, 7000, Accumulation::kSkipHold);
  EXPECT_EQ(skipping.counts.col(0), (Eigen::VectorXd(4) << 1, 3, 8, 14).finished());
  EXPECT_THAT(skipping.judged, ElementsAre(0, 1, 2, 3));
  EXPECT_DOUBLE_EQ(skipping.time_s[3], 0.042);
  EXPECT_STREQ(name_of(Accumulation::kThroughHold), "through hold");
  EXPECT_STREQ(name_of(Accumulation::kSkipHold), "skip hold");
}

TEST(GraspSequence, RefusesPhasesThatDoNotFit) {
  const std::vector<EventCounts> windows(8);
  const GraspPhases good{.first_touch = 1, .hold_begin = 3, .release_begin = 5, .release_end = 7};
  const auto message = [&](auto spoil) {
    GraspPhases phases = good;
    spoil(phases);
    return message_of([&] { grasp_sequence(windows, phases); });
  };
  EXPECT_EQ(message([](auto&) {}), "no error");
  EXPECT_THAT(message([](auto& p) { p.first_touch = -1; }), HasSubstr("-1, 3, 5 and 7"));
  EXPECT_THAT(message([](auto& p) { p.release_begin = 2; }), HasSubstr("must come after"));
  EXPECT_THAT(message([](auto& p) { p.release_end = 9; }), HasSubstr("ends at window 9, there are 8"));
  EXPECT_THAT(message_of([&] { grasp_sequence(windows, good, 0); }), HasSubstr("windows of 0 us"));
}

}  // namespace
}  // namespace touchstone::sensors
