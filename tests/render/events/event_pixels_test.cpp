// Event pixels without noise against closed forms: counts and times; hard light and bad input.
#include "render/events/event_pixels.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/random.h"
#include "core/sha256.h"
#include "event_light.h"
#include "render/events/event_order.h"
#include "render/events/log_photocurrent.h"

namespace touchstone::render {
namespace {

TEST(EventOrder, IsByTimeAndElseAsItWas) {
  RandomStream random(2, 0, Purpose::kTest);
  for (const std::int64_t length : {std::int64_t{1}, std::int64_t{2047}, std::int64_t{2048}, std::int64_t{1} << 40}) {
    std::vector<Event> events;
    for (int i = 0; i < 5000; ++i) {
      const auto us = static_cast<std::int64_t>(random.uniform() * static_cast<double>(length));
      events.push_back({-7 + 1 + us, static_cast<std::uint16_t>(i), 0, false});
    }
    std::vector<Event> expected = events;
    std::stable_sort(expected.begin(), expected.end(), [](const Event& a, const Event& b) { return a.t_us < b.t_us; });
    std::vector<Event> spare;
    sort_by_time(events, spare, -7, -7 + length);
    for (std::size_t i = 0; i < events.size(); ++i) ASSERT_EQ(order_of(events[i]), order_of(expected[i])) << length;
  }
}

TEST(EventPixels, TheLargestThresholdsAndStepsStayInTheirBits) {
  EventPixelSettings settings = ideal(5.0, 5.0);
  settings.threshold_spread = 5.0;
  settings.dark_intensity = 1.0;
  settings.leak_rate_hz = 0.3;
  const cv::Size size(100, 80);
  EventPixels pixels(settings, size, 1, 1);
  std::vector<Event> events;
  const auto largest = static_cast<double>(static_cast<float>(kLargestPhotocurrent) * 0.99F);
  pixels.advance(flat(0.0, size.width, size.height), 0, events);
  pixels.advance(flat(largest, size.width, size.height), 8000000, events);
  const double change = std::log(largest) + 12.0;  // light and leak
  double expected = 0.0;
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) expected += change / pixels.thresholds().at<cv::Vec2f>(y, x)[0];
  }
  // The leak begins at a random phase, so the mean count is the change over the threshold, rounded without bias.
  EXPECT_NEAR(static_cast<double>(events.size()), expected, 5.0 * 0.5 * std::sqrt(size.area()));
  EXPECT_TRUE(std::all_of(events.begin(), events.end(), [](const Event& event) { return event.on; }));
}

TEST(EventPixels, ARampGivesItsChangeOverTheThreshold) {
  for (const double threshold : {0.05, 0.2, 0.31}) {
    for (const double change : {0.9999, 3.0, -5.7}) {
      for (const int steps : {1, 7, 100, 20000}) {
        EventPixels pixels(ideal(threshold, 1.5 * threshold), {1, 1}, 1, 1);
        const auto light = [&](double t) { return 40.0 * std::exp(change * t / (100.0 * steps)); };
        const std::vector<Event> events = watch(pixels, light, 0, 100 * steps, 100);
        const double each = change > 0.0 ? threshold : 1.5 * threshold;
        EXPECT_NEAR(static_cast<double>(events.size()), std::floor(std::abs(change) / each), 1.0);
        // Unless a crossing falls on the end to within float's rounding, the count is exact.
        const double share = std::abs(change) / each - std::floor(std::abs(change) / each);
        if (share > 1e-3 && share < 1.0 - 1e-3) {
          EXPECT_EQ(events.size(), static_cast<std::size_t>(std::abs(change) / each)) << threshold << " " << change;
        }
        for (const Event& event : events) EXPECT_EQ(event.on, change > 0.0);
      }
    }
  }
}

TEST(EventPixels, NoRemainderIsLostInSwingsOfThousandsOfFrames) {
  // Up and down 200 times through 10.5 thresholds in each direction: whatever was lost or gained in a turn would add
  // up.
  EventPixels pixels(ideal(), {1, 1}, 1, 1);
  const auto light = [](double t) {
    const double phase = std::fmod(t / 5000.0, 2.0);
    return 3.0 * std::exp(2.1 * (phase < 1.0 ? phase : 2.0 - phase));
  };
  const std::vector<Event> events = watch(pixels, light, 0, 200 * 10000, 50);
  // First up 10; each later move down and up again from the last event's level another 10 of each kind.
  EXPECT_EQ(events.size(), 200u * 20u);
  EXPECT_EQ(std::count_if(events.begin(), events.end(), [](const Event& event) { return event.on; }), 2000);
  EXPECT_TRUE(in_order(events));
}

TEST(EventPixels, RampsCrossAtTheirTimes) {
  for (const std::int64_t step : {100, 1000, 100000}) {
    EventPixels pixels(ideal(), {3, 2}, 1, 1);
    const double rate = 37.0 * 1e-6;  // per us
    const std::vector<Event> events = watch(
        pixels, [&](double t) { return 2.0 * std::exp(rate * t); }, 0, 400000, step);
    ASSERT_EQ(events.size(), 6u * 74u);  // 14.8 / 0.2, the last at the very end
    for (std::size_t i = 0; i < events.size(); ++i) {
      const double crossing = 0.2 * static_cast<double>(i / 6 + 1) / rate;
      // The first whole microsecond after it; float's rounding of the light moves the crossing by 0.01 us.
      EXPECT_GE(static_cast<double>(events[i].t_us), crossing - 0.02) << step;
      EXPECT_LT(static_cast<double>(events[i].t_us), crossing + 1.02) << step;
      EXPECT_EQ(events[i].y, (i % 6) / 3);
      EXPECT_EQ(events[i].x, i % 3);
    }
  }
}

TEST(EventPixels, TheFirstIntervalHasItsEvents) {
  EventPixels pixels(ideal(), {1, 1}, 1, 1);
  std::vector<Event> events;
  cv::Mat image = flat(1.0);
  pixels.advance(image, 0, events);
  EXPECT_TRUE(events.empty());
  image.at<float>(0, 0) = static_cast<float>(std::exp(1.1));  // the same memory: nothing may be kept of it
  pixels.advance(image, 1000, events);
  EXPECT_EQ(events.size(), 5u);
}

TEST(EventPixels, RisingAndFallingLightMirrorEachOther) {
  EventPixels up(ideal(), {1, 1}, 1, 1);
  EventPixels down(ideal(), {1, 1}, 1, 1);
  const auto wave = [](double t) { return 1.3 * std::sin(t / 3000.0) + 0.4 * std::sin(t / 700.0); };
  const std::vector<Event> a = watch(
      up, [&](double t) { return std::exp(wave(t)); }, 0, 60000, 200);
  const std::vector<Event> b = watch(
      down, [&](double t) { return std::exp(-wave(t)); }, 0, 60000, 200);
  ASSERT_EQ(a.size(), b.size());
  EXPECT_GT(a.size(), 60u);
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_NEAR(static_cast<double>(a[i].t_us), static_cast<double>(b[i].t_us), 1.0);
    EXPECT_NE(a[i].on, b[i].on);
  }
}

TEST(EventPixels, ConstantLightIsSilent) {
  for (const double light : {0.0, 1e-12, 1.0, 1e6}) {
    EventPixelSettings settings = ideal(kLeastEventThreshold, kLeastEventThreshold);
    settings.bandwidth_hz = 100.0;
    settings.reference_intensity = 1.0;
    settings.refractory_us = 3;
    EventPixels pixels(settings, {5, 4}, 1, 1);
    EXPECT_TRUE(watch(
                    pixels, [light](double) { return light; }, 0, 1000000, 500)
                    .empty())
        << light;
  }
}

TEST(EventPixels, ZeroAndHugeStepsStayFinite) {
  EventPixelSettings settings = ideal();
  settings.dark_intensity = 1.0;
  EventPixels pixels(settings, {2, 1}, 1, 1);
  std::vector<Event> events;
  pixels.advance(flat(0.0, 2), 0, events);
  pixels.advance(flat(1e6 - 1.0, 2), 1000, events);  // 13.8155 log units
  EXPECT_EQ(events.size(), 2u * 69u);
  EXPECT_TRUE(in_order(events));
  events.clear();
  pixels.advance(flat(0.0, 2), 1001, events);  // all within one microsecond
  EXPECT_EQ(events.size(), 2u * 69u);
  for (const Event& event : events) {
    EXPECT_EQ(event.t_us, 1001);
    EXPECT_FALSE(event.on);
  }
  EXPECT_TRUE(in_order(events));
}

TEST(EventPixels, TwoEventsOfAMicrosecondBothCome) {
  EventPixels pixels(ideal(), {1, 1}, 1, 1);
  std::vector<Event> events;
  pixels.advance(flat(1.0), 10, events);
  pixels.advance(flat(std::exp(0.5)), 11, events);
  pixels.advance(flat(1.0), 12, events);
  ASSERT_EQ(events.size(), 4u);
  EXPECT_EQ(events[0].t_us, 11);
  EXPECT_EQ(events[1].t_us, 11);
  EXPECT_TRUE(events[0].on && events[1].on);
  EXPECT_EQ(events[3].t_us, 12);
  EXPECT_FALSE(events[2].on || events[3].on);
}

TEST(EventPixels, AnyNumberOfThreadsGivesTheSameEvents) {
  EventPixelSettings settings = davis240c(1000.0);
  settings.shot_rate_hz = 200.0;
  std::vector<std::string> hashes;
  for (const int threads : {1, 2, 4}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
    EventPixels pixels(settings, {kDavis240cWidth, kDavis240cHeight}, 3, 4);
    std::vector<Event> events;
    cv::Mat image(kDavis240cHeight, kDavis240cWidth, CV_32FC1);
    for (int frame = 0; frame <= 40; ++frame) {
      for (int y = 0; y < image.rows; ++y) {
        for (int x = 0; x < image.cols; ++x) {
          image.at<float>(y, x) = static_cast<float>(300.0 + 290.0 * std::sin(0.1 * x + 0.07 * y + 0.15 * frame));
        }
      }
      pixels.advance(image, frame * 1000, events);
    }
    EXPECT_TRUE(in_order(events));
    EXPECT_GT(events.size(), 10000u);
    Sha256 hash;
    for (const Event& event : events) {
      const std::string line = std::to_string(event.t_us) + " " + std::to_string(event.x) + " " +
                               std::to_string(event.y) + (event.on ? " +" : " -");
      hash.add(line);
    }
    hashes.push_back(hash.digest());
  }
  EXPECT_EQ(hashes[0], hashes[1]);
  EXPECT_EQ(hashes[0], hashes[2]);
}

TEST(EventPixels, BadPicturesAreRefusedAndChangeNothing) {
  EventPixels pixels(ideal(), {60, 50}, 1, 1);
  std::vector<Event> events;
  pixels.advance(flat(1.0, 60, 50), 100, events);
  const cv::Mat before = pixels.photoreceptor_output();
  for (const float bad :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), -1e-3F, 1e30F}) {
    cv::Mat image = flat(5.0, 60, 50);
    image.at<float>(41, 7) = bad;
    image.at<float>(42, 3) = bad;
    EXPECT_THAT(message_of([&] { pixels.advance(image, 200, events); }), testing::HasSubstr("column 7, row 41"));
  }
  EXPECT_THAT(message_of([&] { pixels.advance(flat(1.0, 61, 50), 200, events); }), testing::HasSubstr("60 x 50"));
  EXPECT_THROW(pixels.advance(cv::Mat(50, 60, CV_8UC1, cv::Scalar(1)), 200, events), Error);
  EXPECT_THROW(pixels.advance(cv::Mat(), 200, events), Error);
  EXPECT_THAT(message_of([&] { pixels.advance(flat(1.0, 60, 50), 100, events); }), testing::HasSubstr("100 us"));
  EXPECT_THROW(pixels.advance(flat(1.0, 60, 50), 99, events), Error);
  EXPECT_THROW(pixels.advance(flat(1.0, 60, 50), std::numeric_limits<std::int64_t>::max(), events), Error);
  EXPECT_TRUE(events.empty());
  EXPECT_EQ(cv::norm(before, pixels.photoreceptor_output(), cv::NORM_INF), 0.0);
  pixels.advance(flat(std::exp(0.3), 60, 50), 200, events);
  EXPECT_EQ(events.size(), 3000u);
  EXPECT_THROW(EventPixels(ideal(), {2, 2}, 1, 1).photoreceptor_output(), Error);
}

TEST(EventPixels, BadSettingsAreRefusedNamingTheField) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto refused = [](const char* field, const std::function<void(EventPixelSettings&)>& spoil) {
    EventPixelSettings settings = davis240c(1.0);
    ASSERT_NO_THROW(check(settings));
    spoil(settings);
    EXPECT_THAT(message_of([&] { EventPixels(settings, {2, 2}, 1, 1); }), testing::HasSubstr(field));
  };
  refused("on_threshold", [](auto& s) { s.on_threshold = 0.5 * kLeastEventThreshold; });
  refused("on_threshold", [nan](auto& s) { s.on_threshold = nan; });
  refused("off_threshold", [](auto& s) { s.off_threshold = 0.0; });
  refused("off_threshold", [](auto& s) { s.off_threshold = 5.1; });
  refused("threshold_spread", [](auto& s) { s.threshold_spread = -0.1; });
  refused("threshold_spread", [](auto& s) { s.threshold_spread = 0.21; });
  refused("dark_intensity", [](auto& s) { s.dark_intensity = 0.0; });
  refused("bandwidth_hz", [](auto& s) { s.bandwidth_hz = -1.0; });
  refused("reference_intensity", [](auto& s) { s.reference_intensity = 0.0; });
  refused("refractory_us", [](auto& s) { s.refractory_us = -1; });
  refused("leak_rate_hz", [nan](auto& s) { s.leak_rate_hz = nan; });
  refused("shot_rate_hz", [](auto& s) { s.shot_rate_hz = -1.0; });
  refused("shot_half_intensity", [nan](auto& s) { s.shot_half_intensity = nan; });
  EXPECT_THROW(EventPixels(ideal(), {0, 2}, 1, 1), Error);
  EXPECT_THROW(EventPixels(ideal(), {2, 70000}, 1, 1), Error);
  EXPECT_THROW(davis240c(0.0), Error);
  EXPECT_THROW(davis240c(nan), Error);
}

TEST(NeededSubdivisions, KeepEveryStepUnderTheLargestChange) {
  const EventPixelSettings settings = ideal();
  const cv::Mat before = log_intensity(flat(1.0, 5, 4), settings);
  EXPECT_EQ(needed_subdivisions(before, before, 0.1), 0);
  for (const double change : {0.05, 0.099, 0.101, 0.35, -2.0, 7.77}) {
    cv::Mat light = flat(1.0, 5, 4);
    light.at<float>(2, 3) = static_cast<float>(std::exp(change));
    const int between = needed_subdivisions(before, log_intensity(light, settings), 0.1);
    EXPECT_LT(std::abs(change) / (between + 1), 0.1 + 1e-6);
    if (between > 0) {
      EXPECT_GE(std::abs(change) / between, 0.1 - 1e-6);
    }
  }
  EXPECT_THROW(needed_subdivisions(before, flat(0.0, 4, 4), 0.1), Error);
  EXPECT_THROW(needed_subdivisions(before, before, 0.0), Error);
  EXPECT_THROW(needed_subdivisions(before, flat(std::numeric_limits<double>::infinity(), 5, 4), 0.1), Error);
  EXPECT_THROW(log_intensity(flat(-1.0), settings), Error);
  EXPECT_THROW(log_intensity(cv::Mat(), settings), Error);
  // No light at all is the dark's current.
  EXPECT_NEAR(log_intensity(flat(0.0), settings).at<float>(0, 0), std::log(1e-9), 1e-5);
}

}  // namespace
}  // namespace touchstone::render
