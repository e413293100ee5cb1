// How detectors of slip are scored, on runs made by hand.

#include "lab/gelsight/gelsight_slip_experiment.h"

#include <gtest/gtest.h>

#include <cmath>

namespace touchstone::lab {
namespace {

/// A run at 30 frames/s whose shear load grows from frame 4 on and slides at `onset_s`; slip is reported in these
/// frames.
SlipRun run_with(std::optional<double> onset_s, const std::vector<int>& rule, const std::vector<int>& incipient) {
  SlipRun run;
  run.onset_s = onset_s;
  for (int i = 0; i < 12; ++i) {
    SlipFrame frame;
    frame.t_s = i / 30.0;
    frame.load = i < 4 ? 0.0 : std::min(0.2 * (i - 3), 1.0);
    frame.rim.state = sensors::SlipState::kSticking;
    run.frames.push_back(frame);
  }
  for (const int i : rule) run.frames[static_cast<std::size_t>(i)].rule = true;
  for (const int i : incipient) run.frames[static_cast<std::size_t>(i)].rim.state = sensors::SlipState::kIncipient;
  return run;
}

TEST(SlipScore, DelaysCountFromTheOnset) {
  const std::vector<SlipRun> runs = {run_with(8.0 / 30.0, {10, 11}, {7, 8}), run_with(8.0 / 30.0, {}, {9})};
  const SlipScore rule = score(runs, SlipDetector::rule);
  EXPECT_EQ(rule.slides, 2);
  EXPECT_EQ(rule.found, 1);
  EXPECT_EQ(rule.found_before, 0);
  EXPECT_NEAR(rule.median_delay_ms(), 2.0 / 30.0 * 1e3, 1e-9);
  const SlipScore incipient = score(runs, SlipDetector::incipient);
  EXPECT_EQ(incipient.found, 2);
  EXPECT_EQ(incipient.found_before, 1);
  EXPECT_NEAR(incipient.median_delay_ms(), 0.0, 1e-9);  // once a frame before, once a frame after
}

TEST(SlipScore, ReportsWithoutSlipAreFalseAlarms) {
  // Two frames of a quiet run, and one before any shear of a run that slides later, which isn't a find.
  const std::vector<SlipRun> runs = {run_with(std::nullopt, {}, {3, 9}), run_with(8.0 / 30.0, {}, {1})};
  const SlipScore result = score(runs, SlipDetector::incipient);
  EXPECT_EQ(result.quiet_runs, 1);
  EXPECT_EQ(result.false_runs, 1);
  EXPECT_EQ(result.quiet_frames, 12 + 4);
  EXPECT_EQ(result.false_frames, 3);
  EXPECT_NEAR(result.false_alarms_percent(), 100.0 * 3 / 16, 1e-12);
  EXPECT_EQ(result.found, 0);
  EXPECT_TRUE(std::isnan(result.median_delay_ms()));
  EXPECT_EQ(score({}, SlipDetector::rule).false_alarms_percent(), 0.0);
}

TEST(SlipScore, OnlySlidesWithTimeEnoughArePredictable) {
  std::vector<SlipRun> runs = {run_with(8.0 / 30.0, {}, {7}), run_with(8.0 / 30.0, {}, {9}),
                               run_with(8.0 / 30.0, {}, {9})};
  runs[0].partial_s = 6.0 / 30.0;  // two frames
  runs[1].partial_s = 5.0 / 30.0;
  runs[2].partial_s = 7.0 / 30.0;
  const SlipScore result = score(runs, SlipDetector::incipient, 2.0 / 30.0);
  EXPECT_EQ(result.slides, 3);
  EXPECT_EQ(result.predictable, 2);
  EXPECT_EQ(result.predicted, 1);
}

TEST(SlipScore, ACaseHasANameThatTellsItApart) {
  SlipCase one;
  one.normal_N = 0.4;
  one.object.name = "ball-16mm";
  one.object.friction = 0.6;
  EXPECT_EQ(one.name(), "slide ball-16mm, mu 0.6, 0.4 N, 2 mm/s");
  one.motion = SlipMotion::load;
  EXPECT_EQ(one.name(), "load ball-16mm, mu 0.6, 0.4 N, 0.5 of the limit");
}

}  // namespace
}  // namespace touchstone::lab
