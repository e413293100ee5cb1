// What makes real event pixels differ from ideal ones: thresholds of their own, refractory time, leak and shot noise.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <vector>

#include "event_light.h"
#include "render/events/event_pixels.h"

namespace touchstone::render {
namespace {

TEST(EventNoise, LeakGivesOnEventsAtItsRate) {
  EventPixelSettings settings = ideal(0.25, 0.2);
  settings.leak_rate_hz = 3.0;
  const cv::Size size(40, 30);
  for (const std::int64_t step : {1000, 250000}) {
    EventPixels pixels(settings, size, 1, 1);
    const std::vector<Event> events = watch(
        pixels, [](double) { return 1.0; }, 0, 5000000, step);
    // A ramp at a random phase: 15 events of each pixel, but for one at either end.
    EXPECT_NEAR(static_cast<double>(events.size()), 15.0 * size.area(), 2.0);
    std::vector<std::int64_t> last(static_cast<std::size_t>(size.area()), -1);
    for (const Event& event : events) {
      EXPECT_TRUE(event.on);
      std::int64_t& before = last[static_cast<std::size_t>(event.y * size.width + event.x)];
      if (before >= 0) {
        EXPECT_NEAR(static_cast<double>(event.t_us - before), 1e6 / 3.0, 1.5);
      }
      before = event.t_us;
    }
    // The pixels don't leak in step.
    const auto early = std::count_if(events.begin(), events.end(), [](const Event& e) { return e.t_us < 166667; });
    EXPECT_NEAR(static_cast<double>(early), 600.0, 6.0 * std::sqrt(300.0));
  }
}

TEST(EventNoise, ALeakOfLongStandingLosesNothing) {
  EventPixelSettings settings = ideal();
  settings.leak_rate_hz = 1e4;
  EventPixels pixels(settings, {1, 1}, 1, 1);
  // 2000 log units in one interval: more than 32 bits of level hold.
  const std::vector<Event> events = watch(
      pixels, [](double) { return 1.0; }, 0, 1000000, 1000000);
  EXPECT_NEAR(static_cast<double>(events.size()), 10000.0, 1.0);
}

TEST(EventNoise, ShotNoiseIsPoissonAndFallsWithTheLight) {
  EventPixelSettings settings = ideal();
  settings.shot_rate_hz = 4.0;
  settings.shot_half_intensity = 2.0;
  const cv::Size size(64, 40);
  for (const double light : {0.0, 2.0, 14.0}) {
    const double rate = 4.0 / (1.0 + light / 2.0);
    for (const std::int64_t step : {500, 500000}) {
      EventPixels pixels(settings, size, 1, 77);
      const std::vector<Event> events = watch(
          pixels, [light](double) { return light; }, 0, 2000000, step);
      const double mean = 2.0 * rate * size.area();
      const auto count = static_cast<double>(events.size());
      EXPECT_NEAR(count, mean, 4.5 * std::sqrt(mean)) << light;
      const auto on = std::count_if(events.begin(), events.end(), [](const Event& event) { return event.on; });
      EXPECT_NEAR(static_cast<double>(on), 0.5 * count, 4.5 * 0.5 * std::sqrt(count));
      // Counts of the pixels: variance equals mean.
      cv::Mat counts = cv::Mat::zeros(size, CV_64F);
      for (const Event& event : events) counts.at<double>(event.y, event.x) += 1.0;
      cv::Scalar average, deviation;
      cv::meanStdDev(counts, average, deviation);
      const double variance = deviation[0] * deviation[0];
      const double m = average[0];
      EXPECT_NEAR(variance, m, 4.5 * std::sqrt((2.0 * m * m + m) / size.area()));
      EXPECT_TRUE(in_order(events));
    }
  }
}

TEST(EventNoise, ShotNoiseFollowsTheLightBetweenFrames) {
  // Light grows from 0 to 6 times the half light, by 4.1 log units: below the thresholds, so that all events are noise.
  // Over frames that come densely the rate is integrated, over a single interval it's that of the mean light.
  EventPixelSettings settings = ideal(5.0, 5.0);
  settings.dark_intensity = 0.1;
  settings.shot_rate_hz = 30.0;
  settings.shot_half_intensity = 1.0;
  const cv::Size size(64, 50);
  for (const std::int64_t step : {10000, 1000000}) {
    EventPixels pixels(settings, size, 1, 3);
    const std::vector<Event> events = watch(
        pixels, [](double t) { return 6.0 * t / 1e6; }, 0, 1000000, step);
    const double mean = 30.0 * (step == 1000000 ? 1.0 / 4.0 : std::log(7.0) / 6.0) * size.area();
    EXPECT_NEAR(static_cast<double>(events.size()), mean, 4.5 * std::sqrt(mean)) << step;
  }
}

TEST(EventNoise, NoiseDoesntDependOnHowDenselyFramesCome) {
  EventPixelSettings settings = ideal();
  settings.shot_rate_hz = 20.0;
  settings.shot_half_intensity = 1.0;
  std::vector<std::vector<Event>> runs;
  for (const std::int64_t step : {1000, 50000}) {
    EventPixels pixels(settings, {16, 16}, 1, 5);
    runs.push_back(watch(
        pixels, [](double) { return 0.5; }, 0, 500000, step));
  }
  ASSERT_EQ(runs[0].size(), runs[1].size());
  for (std::size_t i = 0; i < runs[0].size(); ++i) {
    EXPECT_NEAR(static_cast<double>(runs[0][i].t_us), static_cast<double>(runs[1][i].t_us), 1.0);
  }
}

TEST(EventNoise, TheRefractoryTimeBoundsTheRate) {
  EventPixelSettings settings = ideal();
  settings.refractory_us = 300;
  settings.shot_rate_hz = 2000.0;
  settings.shot_half_intensity = 1e9;
  for (const std::int64_t step : {50, 1000, 20000}) {
    EventPixels pixels(settings, {4, 4}, 1, 9);
    const std::vector<Event> events = watch(
        pixels, [](double t) { return std::exp(2.0 * std::sin(t / 1000.0)); }, 0, 100000, step);
    EXPECT_GT(events.size(), 1000u);
    std::vector<std::int64_t> last(16, -1000);
    for (const Event& event : events) {
      std::int64_t& before = last[static_cast<std::size_t>(event.y * 4 + event.x)];
      ASSERT_GE(event.t_us - before, 300);
      before = event.t_us;
    }
  }
}

TEST(EventNoise, ARefractoryPixelBeginsAnewAtItsEnd) {
  // On a ramp an event comes every C / rate + refractory time, however frames fall.
  EventPixelSettings settings = ideal();
  settings.refractory_us = 700;
  for (const std::int64_t step : {90, 1000, 30000}) {
    EventPixels pixels(settings, {1, 1}, 1, 1);
    const double rate = 1e-4;
    const std::vector<Event> events = watch(
        pixels, [&](double t) { return 1e-3 * std::exp(rate * t); }, 0, 180000, step);
    ASSERT_GE(events.size(), 66u);
    for (std::size_t i = 0; i < events.size(); ++i) {
      EXPECT_NEAR(static_cast<double>(events[i].t_us), 2000.0 + 2700.0 * static_cast<double>(i), 2.0) << step;
    }
  }
}

TEST(EventNoise, ThresholdsAreGaussianAndTheUnitsOwn) {
  EventPixelSettings settings = ideal(0.3, 0.2);
  settings.threshold_spread = 0.02;
  const cv::Size size(200, 150);
  const EventPixels one(settings, size, 1, 1);
  const EventPixels again(settings, size, 1, 2);
  const EventPixels other(settings, size, 2, 1);
  cv::Scalar mean, deviation;
  cv::meanStdDev(one.thresholds(), mean, deviation);
  EXPECT_NEAR(mean[0], 0.3, 5.0 * 0.02 / std::sqrt(30000.0));
  EXPECT_NEAR(mean[1], 0.2, 5.0 * 0.02 / std::sqrt(30000.0));
  EXPECT_NEAR(deviation[0], 0.02, 5.0 * 0.02 / std::sqrt(60000.0));
  EXPECT_NEAR(deviation[1], 0.02, 5.0 * 0.02 / std::sqrt(60000.0));
  EXPECT_EQ(cv::norm(one.thresholds(), again.thresholds(), cv::NORM_INF), 0.0);
  EXPECT_GT(cv::norm(one.thresholds(), other.thresholds(), cv::NORM_INF), 0.05);
  // A pixel of a larger picture is the same pixel.
  const EventPixels larger(settings, {300, 200}, 1, 1);
  EXPECT_EQ(cv::norm(one.thresholds(), larger.thresholds()(cv::Rect(0, 0, 200, 150)), cv::NORM_INF), 0.0);
  settings.threshold_spread = 0.2;  // half the tail would be below zero
  const EventPixels uneven(settings, size, 1, 1);
  EXPECT_GE(uneven.smallest_threshold(), 0.02 - 1e-6);
}

TEST(EventNoise, PresetMeetsThePublishedNoiseOfTheSensor) {
  const cv::Size size(kDavis240cWidth, kDavis240cHeight);
  const double klux = 2e4;
  EventPixels steady(davis240c(klux), size, 1, 1);
  const double bright = static_cast<double>(watch(
                                                steady, [&](double) { return klux; }, 0, 5000000, 1000000)
                                                .size());
  EXPECT_NEAR(bright / (5.0 * size.area()), 0.1, 0.01);  // per pixel and second
  EventPixels unlit(davis240c(klux), size, 1, 1);
  const double dark = static_cast<double>(watch(
                                              unlit, [](double) { return 0.0; }, 0, 500000, 100000)
                                              .size());
  EXPECT_NEAR(dark / (0.5 * size.area()), 5.0, 0.15);
}

}  // namespace
}  // namespace touchstone::render
