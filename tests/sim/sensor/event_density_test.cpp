// Events between adaptively placed pictures against those of pictures that are dense everywhere.

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "sim/press/state_between.h"
#include "sim/sensor/event_stream.h"
#include "sim/sensor/light_sequence.h"
#include "tests/sim/press/moving_scene.h"

namespace touchstone::sim {
namespace {

/// Counts of one threshold's crossings, by definition: a pixel's level follows its light in whole thresholds.
struct CountedCrossings {
  explicit CountedCrossings(const cv::Mat& log) : level(log.clone()) {
    on = cv::Mat(log.size(), CV_32S, cv::Scalar(0));
    off = on.clone();
  }
  void follow(const cv::Mat& log, float on_threshold, float off_threshold) {
    for (int y = 0; y < log.rows; ++y) {
      for (int x = 0; x < log.cols; ++x) {
        float& at = level.at<float>(y, x);
        for (; log.at<float>(y, x) - at >= on_threshold; at += on_threshold) ++on.at<int>(y, x);
        for (; log.at<float>(y, x) - at <= -off_threshold; at -= off_threshold) ++off.at<int>(y, x);
      }
    }
  }
  cv::Mat level, on, off;
};

TEST(EventDensity, CountsAreThoseOfDensePicturesWithinOneEventAPixel) {
  SceneSpec scene = moving_scene("  - {frames: 3, z: {position_mm: 1.85}}\n");
  scene.outputs = {.frames = false, .ideal = false};
  scene.outputs.events = true;
  const Plan plan = make_plan(scene);
  const auto truths = play_motion(scene, plan, *moving_gel());
  const LightSequence light(scene, plan, *moving_gel(), 0.15);
  CountedCrossings dense(light.first(truths.front().press).log_photocurrent);
  constexpr int kParts = 50;  // a hundredth of a pixel
  for (std::size_t f = 1; f < truths.size(); ++f) {
    for (int k = 1; k <= kParts; ++k) {
      const fem::PressState press =
          state_between(truths[f - 1].press, truths[f].press, static_cast<double>(k) / kParts);
      dense.follow(light.first(press).log_photocurrent, 0.15F, 0.2F);
    }
  }
  cv::Mat on(dense.on.size(), CV_32S, cv::Scalar(0));
  cv::Mat off = on.clone();
  watch_events(scene, plan, *moving_gel(), 1, [&](std::span<const Event> events) {
    for (const Event& event : events) ++(event.on ? on : off).at<int>(event.y, event.x);
  });
  EXPECT_GT(cv::sum(dense.on + dense.off)[0], 100) << "too little happens";
  EXPECT_LE(cv::norm(on, dense.on, cv::NORM_INF), 1.0);
  EXPECT_LE(cv::norm(off, dense.off, cv::NORM_INF), 1.0);
}

}  // namespace
}  // namespace touchstone::sim
