// The hard case of time stamps, 44, of what renders light in time: pictures for event pixels, instants of an exposure.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <vector>

#include "render/cameras/rolling_shutter.h"
#include "render/events/event_pixels.h"
#include "tests/hard_cases/hard_case.h"
#include "tests/render/events/event_light.h"

namespace touchstone::render {
namespace {

using test::did;
using test::refused;
using ::testing::HasSubstr;

TEST(HardCase44Light, EventPixelsRefuseAndGoOn) {
  EventPixelSettings settings = ideal();
  settings.bandwidth_hz = 300.0;
  settings.reference_intensity = 1.0;
  settings.leak_rate_hz = 20.0;
  settings.shot_rate_hz = 100.0;
  settings.shot_half_intensity = 1.0;
  settings.refractory_us = 100;
  EventPixels pixels(settings, {4, 4}, 1, 1);
  EventPixels other(settings, {4, 4}, 1, 1);
  std::vector<Event> events, wanted;
  std::string said;
  std::int64_t t_us = -1000;
  for (const double light : {1.0, 3.0, 0.2, 5.0, 0.9}) {
    pixels.advance(flat(light, 4, 4), t_us, events);
    other.advance(flat(light, 4, 4), t_us, wanted);
    for (const std::int64_t bad_us : {t_us, t_us - 1, std::int64_t{-1'000'000}}) {
      said = message_of([&] { pixels.advance(flat(100.0, 4, 4), bad_us, events); });
      EXPECT_THAT(said, HasSubstr(fmt::format("the time is {} us; allowed is a time after the last picture's, {} us",
                                              bad_us, t_us)));
    }
    for (const std::int64_t bad_us :
         {std::numeric_limits<std::int64_t>::min(), std::numeric_limits<std::int64_t>::max()}) {
      EXPECT_THAT(message_of([&] { pixels.advance(flat(100.0, 4, 4), bad_us, events); }), HasSubstr("allowed is"));
    }
    t_us += 7000;
  }
  ASSERT_EQ(events.size(), wanted.size());
  EXPECT_GT(events.size(), 100U);
  for (std::size_t i = 0; i < events.size(); ++i) EXPECT_EQ(order_of(events[i]), order_of(wanted[i]));
  did("event pixels: a picture at the last one's time, or before, is {}; their {} events are the same to the bit",
      refused(said), events.size());
}

TEST(HardCase44Light, AnExposureOfEqualOrBackwardInstantsIsRefused) {
  const auto says = [](const std::vector<double>& times_s) {
    return message_of([&] { exposure_shares(times_s, 0.0, 0.01); });
  };
  EXPECT_FALSE(says({0.0, 0.005, 0.005, 0.01}).empty());
  EXPECT_FALSE(says({0.0, 0.006, 0.005, 0.01}).empty());
  EXPECT_FALSE(says({0.0, std::numeric_limits<double>::quiet_NaN(), 0.01}).empty());
  EXPECT_FALSE(says({0.01, 0.0}).empty());
  EXPECT_FALSE(says({0.0, std::numeric_limits<double>::infinity()}).empty());
  const std::vector<TimedIrradiance> backward = {
      {0.0, flat(1.0, 2, 2)}, {0.01, flat(1.0, 2, 2)}, {0.01, flat(2.0, 2, 2)}, {0.02, flat(2.0, 2, 2)}};
  const std::string said = message_of([&] { rolling_exposure(backward, {0.0, 0.01, 0.001}); });
  EXPECT_FALSE(said.empty());
  did("an exposure: instants of one time, or backward, are {}", refused(said));
}

}  // namespace
}  // namespace touchstone::render
