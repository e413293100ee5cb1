// The closed loop of a grasp, led by a stand-in for the estimators: the area in which a frame differs from the first
// one stands for the height, the motion of its middle for slip.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "lab/gelsight/gelsight_grasp_experiment.h"
#include "tests/support/small_scene.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::lab {
namespace {

using ::testing::HasSubstr;

const sim::VirtualSensor& sensor() {
  static const test::TemporaryFolder cache;
  static const sim::VirtualSensor one = [] {
    sim::VirtualSensorSettings settings;
    settings.widest_mm = 1.0;
    return sim::VirtualSensor(test::small_coated_device(), cache.path(), settings);
  }();
  return one;
}

GraspTrial ball(double mass_g) {
  GraspTrial trial;
  trial.object.name = "ball";
  trial.object.shape.radius_mm = 6.0;
  trial.object.friction = 0.6;
  trial.object.mass_g = mass_g;
  trial.object.crush_force_N = 6.0;
  return trial;
}

GraspSenses stand_in() {
  constexpr double kDiffers = 8.0;          // grey levels
  constexpr double kHeightOfAPixel = 1e-3;  // mm
  constexpr double kMoved_px = 0.6;
  struct Memory {
    cv::Mat first;
    std::optional<cv::Point2d> middle;
  };
  return [memory = std::make_shared<Memory>()](const cv::Mat& frame) {
    if (memory->first.empty()) memory->first = frame;
    cv::Mat difference, mask;
    cv::absdiff(frame, memory->first, difference);
    cv::threshold(difference, mask, kDiffers, 255, cv::THRESH_BINARY);
    const cv::Moments moments = cv::moments(mask, true);
    sensors::GraspReading reading;
    reading.height_max_mm = kHeightOfAPixel * moments.m00;
    if (moments.m00 < 20) return reading;
    const cv::Point2d middle(moments.m10 / moments.m00, moments.m01 / moments.m00);
    reading.slip = memory->middle && cv::norm(middle - *memory->middle) > kMoved_px;
    memory->middle = middle;
    return reading;
  };
}

GraspLoopSettings loop() {
  GraspLoopSettings settings;
  settings.arm = {3.0, 6.0, 60.0};
  settings.hold_s = 0.2;
  settings.rule.slip_step_mm = 0.1;
  settings.rule.most_slip_travel_mm = 0.6;
  settings.longest_s = 3.0;
  return settings;
}

/// A ball that the first touch doesn't hold.
double heavy_g() {
  static const double mass = [] {
    GraspTrial light = ball(0.5);
    const GraspOutcome outcome = run_grasp_trial(sensor(), light, loop(), stand_in());
    EXPECT_TRUE(outcome.held) << outcome.failure;
    return 1.4 * 2.0 * light.object.friction * outcome.final_force_N / (sim::kGravity_mm_s2 * 1e-6);
  }();
  return mass;
}

TEST(GraspLoop, ALightObjectIsHeldAtTheFirstTouch) {
  const GraspOutcome outcome = run_grasp_trial(sensor(), ball(0.5), loop(), stand_in());
  EXPECT_TRUE(outcome.held) << outcome.failure;
  EXPECT_EQ(outcome.slid_mm, 0.0);
  EXPECT_GT(outcome.peak_force_N, 0.0);
  EXPECT_NEAR(outcome.moments.back().truth.object_height_mm, 3.0, 0.5);
}

TEST(GraspLoop, SlipIsAnsweredByAStrongerGrip) {
  const GraspOutcome light = run_grasp_trial(sensor(), ball(0.5), loop(), stand_in());
  const GraspOutcome heavy = run_grasp_trial(sensor(), ball(heavy_g()), loop(), stand_in());
  EXPECT_GT(heavy.slip_reactions, light.slip_reactions);
  EXPECT_GT(heavy.peak_force_N, 1.4 * light.peak_force_N);
  EXPECT_GT(heavy.slid_mm, 0.0);
}

TEST(GraspLoop, WithoutTheAnswerToSlipTheSameObjectStaysBehind) {
  GraspLoopSettings blind = loop();
  blind.rule.react_to_slip = false;
  const GraspOutcome outcome = run_grasp_trial(sensor(), ball(heavy_g()), blind, stand_in());
  EXPECT_FALSE(outcome.held);
  EXPECT_EQ(outcome.slip_reactions, 0);
  EXPECT_LT(outcome.moments.back().truth.object_height_mm, 1.0);
}

TEST(GraspLoop, WhatIsSeenIsAsOldAsTheCamerasLag) {
  // 30 pixels. What is seen grows by 20 and more from the frame before; at 40 a pixel of noise decided between two
  // frames.
  constexpr double kSeen_mm = 0.03;
  GraspLoopSettings settings = loop();
  const auto first_sight = [&](double lag_s) {
    settings.camera_lag_s = lag_s;
    const GraspOutcome outcome = run_grasp_trial(sensor(), ball(0.5), settings, stand_in());
    for (std::size_t k = 0; k < outcome.moments.size(); ++k) {
      if (outcome.moments[k].reading.height_max_mm > kSeen_mm) return static_cast<int>(k);
    }
    return -1;
  };
  EXPECT_EQ(first_sight(0.2) - first_sight(0.0), 6);
}

TEST(GraspLoop, AFragileObjectIsCrushedAndSaidToBe) {
  GraspTrial trial = ball(0.5);
  trial.object.crush_force_N = 1e-3;
  const GraspOutcome outcome = run_grasp_trial(sensor(), trial, loop(), stand_in());
  EXPECT_FALSE(outcome.held);
  EXPECT_THAT(outcome.failure, HasSubstr("crushed at"));
}

TEST(GraspLoop, SensesThatSeeNothingCloseUntilTheLimit) {
  GraspLoopSettings settings = loop();
  settings.rule.longest_approach_mm = 0.2;
  const GraspOutcome outcome =
      run_grasp_trial(sensor(), ball(0.5), settings, [](const cv::Mat&) { return sensors::GraspReading{}; });
  EXPECT_FALSE(outcome.held);
  EXPECT_THAT(outcome.failure, HasSubstr("nothing there"));
}

TEST(GraspLoop, RefusesWhatMakesNoSense) {
  GraspTrial weightless = ball(1.0);
  weightless.object.mass_g.reset();
  EXPECT_THROW(run_grasp_trial(sensor(), weightless, loop(), stand_in()), Error);
  GraspLoopSettings settings = loop();
  settings.camera_lag_s = -0.1;
  EXPECT_THROW(run_grasp_trial(sensor(), ball(1.0), settings, stand_in()), Error);
  settings = loop();
  settings.rule.touch_height_mm = 0.0;
  EXPECT_THROW(run_grasp_trial(sensor(), ball(1.0), settings, stand_in()), Error);
}

}  // namespace
}  // namespace touchstone::lab
