// The logarithm and the low-pass of the event pixels' photoreceptor.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <vector>

#include "core/random.h"
#include "core/units.h"
#include "event_light.h"
#include "render/events/event_pixels.h"
#include "render/events/log_photocurrent.h"

namespace touchstone::render {
namespace {

TEST(LogPhotocurrent, IsTheLogarithmOverAllMagnitudes) {
  RandomStream random(1, 0, Purpose::kTest);
  double worst = 0.0;
  for (int i = 0; i < 200000; ++i) {
    const auto x = static_cast<float>(std::exp2(120.0 * random.uniform() - 60.0));
    worst = std::max(worst, std::abs(level_of(x) / kLevelPerLog2 - std::log2(static_cast<double>(x))));
  }
  EXPECT_LT(worst, 2e-7);
  for (int e = -60; e <= 60; ++e) {
    EXPECT_EQ(level_of(static_cast<float>(std::exp2(e))), e * (1 << 24));
  }
}

TEST(LogPhotocurrent, NeverFallsWhereTheLightGrows) {
  std::int32_t last = level_of(1.0F);
  float x = 1.0F;
  for (int i = 0; i < 2000000; ++i) {
    x = std::nextafter(x, 10.0F);
    const std::int32_t level = level_of(x);
    ASSERT_GE(level, last - 1) << x;  // one unit, 6e-8 in log2, is what rounding may do
    last = std::max(last, level);
  }
}

TEST(LogPhotocurrent, RelaxationIsTheExponential) {
  for (double e = 1e-12; e < 1e6; e *= 1.07) {
    const Relaxation relaxed = relaxation(relaxation_exponent(static_cast<float>(e)));
    const double x = static_cast<float>(e);
    EXPECT_NEAR(relaxed.gone / -std::expm1(-x), 1.0, 1e-6) << e;
    if (e < 50.0) {
      EXPECT_NEAR(relaxed.mean_left / (-std::expm1(-x) / x), 1.0, 1e-6) << e;
    }
  }
}

TEST(Photoreceptor, TheLowPassIsTheExponentialHoweverDenselyFramesCome) {
  EventPixelSettings settings = ideal();
  settings.bandwidth_hz = 30.0;
  settings.reference_intensity = 2.0;
  settings.dark_intensity = 0.01;
  for (const double light : {0.5, 2.0}) {
    const double tau_us = 1e6 / (2.0 * kPi * 30.0 * (light + 0.01) / 2.0);
    for (const std::int64_t step : {20, 1000, 7000}) {
      EventPixels pixels(settings, {1, 1}, 1, 1);
      std::vector<Event> events;
      pixels.advance(flat(0.1), -1, events);
      pixels.advance(flat(light), 0, events);  // a step within 1 us
      const double change = std::log(light + 0.01) - std::log(0.11);
      for (std::int64_t t = step; t <= 14000; t += step) {
        pixels.advance(flat(light), t, events);
        const double expected = std::log(light + 0.01) - change * std::exp(-static_cast<double>(t) / tau_us);
        EXPECT_NEAR(pixels.photoreceptor_output().at<double>(0, 0), expected, 2e-4 * change) << step << " " << t;
      }
    }
  }
}

TEST(Photoreceptor, ALaggingPixelFollowsARampBehindByItsTimeConstant) {
  // At a bandwidth that hardly changes along the ramp, v = u - rate tau once it has settled.
  EventPixelSettings settings = ideal();
  settings.bandwidth_hz = 50.0;
  settings.reference_intensity = 1.0;
  settings.dark_intensity = 100.0;  // nearly all of the current: f3dB = 50 * 101 Hz and hardly changes
  EventPixels pixels(settings, {1, 1}, 1, 1);
  std::vector<Event> events;
  for (std::int64_t t = 0; t <= 20000; t += 100) {
    pixels.advance(flat(100.0 * (1e-3 * static_cast<double>(t) / 20000.0)), t, events);
  }
  const double tau_us = 1e6 / (2.0 * kPi * 50.0 * 100.1);
  const double expected = std::log(100.1) - 1e-3 / 20000.0 * tau_us;
  EXPECT_NEAR(pixels.photoreceptor_output().at<double>(0, 0), expected, 4e-7);
}

TEST(Photoreceptor, TheLowPassConvergesWithTheSquareOfTheFrameInterval) {
  // Light, and with it the bandwidth, grows 20 fold: an interval's answer is exact for a straight line at the mean
  // rate.
  EventPixelSettings settings = ideal();
  settings.bandwidth_hz = 40.0;
  settings.reference_intensity = 1.0;
  const auto output = [&](std::int64_t step) {
    EventPixels pixels(settings, {1, 1}, 1, 1);
    watch(
        pixels, [](double t) { return 0.2 * std::exp(3.0 * std::pow(t / 16000.0, 2)); }, 0, 16000, step);
    return pixels.photoreceptor_output().at<double>(0, 0);
  };
  const double truth = output(5);
  EXPECT_GT(std::log(0.2) + 3.0 - truth, 0.05);  // it lags
  const double coarse = output(500) - truth;
  const double fine = output(250) - truth;
  EXPECT_NEAR(coarse / fine, 4.0, 0.6);
  EXPECT_LT(std::abs(fine), 2e-3);
}

TEST(Photoreceptor, TheDarkIsSlow) {
  EventPixelSettings settings = ideal();
  settings.bandwidth_hz = 100.0;
  settings.reference_intensity = 1.0;
  settings.dark_intensity = 1e-4;
  std::vector<std::int64_t> first;
  for (const double light : {1.0, 0.01}) {
    EventPixels pixels(settings, {1, 1}, 1, 1);
    const std::vector<Event> events = watch(
        pixels, [&](double t) { return t < 50.0 ? light : 2.0 * light; }, 0, 1000000, 100);
    ASSERT_FALSE(events.empty());
    first.push_back(events.front().t_us);
  }
  EXPECT_GT(first[1], 50 * first[0]);
}

}  // namespace
}  // namespace touchstone::render
