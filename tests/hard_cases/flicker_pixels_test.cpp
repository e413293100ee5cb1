// The hard case of mains flicker, 45, for event pixels: lamps whose light swings at 100 Hz or 120 Hz, by little or down
// to nothing. Light is 1 + depth sin(2 pi f t), a lamp on rectified mains has a depth of 1.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "core/units.h"
#include "render/events/event_pixels.h"
#include "tests/hard_cases/hard_case.h"
#include "tests/render/events/event_light.h"

namespace touchstone::render {
namespace {

using test::did;
using test::Worst;

struct Lamp45 {
  double depth = 0.0;
  double frequency_Hz = 100.0;
  double dark = 1e-9;  ///< of the pixels

  double angular() const { return 2.0 * kPi * frequency_Hz / kMicrosecondsPerSecond; }  ///< rad/us
  double light(double t_us) const { return std::max(0.0, 1.0 + depth * std::sin(angular() * t_us)); }
  double log_light(double t_us) const { return std::log(light(t_us) + dark); }
  double lowest() const { return std::log(std::max(0.0, 1.0 - depth) + dark); }
  double highest() const { return std::log(1.0 + depth + dark); }
};

std::vector<Event> watch(EventPixels& pixels, const Lamp45& lamp, std::int64_t end_us, std::int64_t step_us) {
  return watch(
      pixels, [&](double t) { return lamp.light(t); }, 0, end_us, step_us);
}

std::int64_t count(const std::vector<Event>& events, bool on) {
  return std::count_if(events.begin(), events.end(), [&](const Event& event) { return event.on == on; });
}

// The level of a pixel's last event goes up and down a ladder of thresholds that stands on where it began. From the
// middle it climbs n rungs to the crest; then each trough is n + m rungs below, each crest as many above.
TEST(HardCase45Pixels, FlickersEventsAreCountedByTheLogarithmOfItsSwing) {
  constexpr int kCycles = 20;
  std::int64_t all = 0;
  int lamps = 0;
  std::int64_t most = 0;
  for (const double frequency_Hz : {100.0, 120.0}) {
    for (const double depth : {0.02, 0.1, 0.37, 0.95, 1.0}) {
      for (const double threshold : {0.2, 0.11, 0.0131}) {
        // At 100 Hz pictures meet crests and troughs exactly; at 120 Hz to half a microsecond, which in deep dark is
        // much.
        const Lamp45 lamp{depth, frequency_Hz, frequency_Hz == 100.0 ? 1e-6 : 1e-2};
        const double start = std::log(1.0 + lamp.dark);
        const double up = (lamp.highest() - start) / threshold;
        const double down = (start - lamp.lowest()) / threshold;
        for (const double rungs : {up, down}) {
          ASSERT_GT(std::abs(rungs - std::round(rungs)), 1e-3) << "at a rung rounding decides";
        }
        const auto climb = static_cast<std::int64_t>(std::floor(up));
        const std::int64_t swing = climb + static_cast<std::int64_t>(std::floor(down));
        EventPixelSettings settings = ideal(threshold, threshold);
        settings.dark_intensity = lamp.dark;
        EventPixels pixels(settings, {1, 1}, 1, 1);
        std::vector<Event> events;
        const double quarter_us = 0.25 * kMicrosecondsPerSecond / frequency_Hz;
        constexpr int kPictures = 40;                               // a quarter of a period
        for (int k = 0; k <= (4 * kCycles + 3) * kPictures; ++k) {  // up to a trough
          const std::int64_t t_us = std::llround(k * quarter_us / kPictures);
          pixels.advance(flat(lamp.light(static_cast<double>(t_us))), t_us, events);
        }
        EXPECT_EQ(count(events, true), climb + kCycles * swing) << frequency_Hz << " " << depth << " " << threshold;
        EXPECT_EQ(count(events, false), (kCycles + 1) * swing) << frequency_Hz << " " << depth << " " << threshold;
        EXPECT_TRUE(in_order(events));
        all += static_cast<std::int64_t>(events.size());
        most = std::max(most, swing);
        ++lamps;
      }
    }
  }
  did("{} lamps that swing by 2 % to all of their light at 100 and 120 Hz before pixels of three thresholds: {} events "
      "in "
      "20 cycles of each, as many as closed form, up to {} of either sign a cycle",
      lamps, all, most);
}

TEST(HardCase45Pixels, AnEventComesWhenTheLogarithmIsThere) {
  const Lamp45 lamp{0.37, 100.0};
  constexpr std::int64_t kStep_us = 10;
  constexpr double kThreshold = 0.05;
  EventPixels pixels(ideal(kThreshold, kThreshold), {1, 1}, 1, 1);
  const std::vector<Event> events = watch(pixels, lamp, 40000, kStep_us);
  ASSERT_GT(events.size(), 50U);
  // A chord between pictures lies beside the curve by its second derivative, a whole microsecond is late by the first.
  const double w = lamp.angular();
  const double slope = w * lamp.depth / std::sqrt(1.0 - lamp.depth * lamp.depth);
  const double chord = w * w * lamp.depth / std::pow(1.0 - lamp.depth, 2) * kStep_us * kStep_us / 8.0;
  Worst away{slope + chord + 1e-6};
  double level = std::log(1.0 + lamp.dark);
  for (const Event& event : events) {
    level += event.on ? kThreshold : -kThreshold;
    EXPECT_LT(away(std::abs(lamp.log_light(static_cast<double>(event.t_us)) - level)), away.bar) << event.t_us;
  }
  did("{} events of a lamp that swings by 37 %: at each one's microsecond the light's logarithm is at the event's "
      "level "
      "to {}",
      events.size(), away.text());
}

// What a pixel counts up less what it counts down is the light's logarithm now less that at the beginning, to a
// threshold of each: however long the lamp flickers, nothing adds up.
TEST(HardCase45Pixels, EventsOfEitherSignBalanceForEver) {
  EventPixelSettings settings = ideal(0.2, 0.15);
  settings.threshold_spread = 0.03;
  const cv::Size size(16, 8);
  EventPixels pixels(settings, size, 45, 1);
  const Lamp45 lamp{0.8, 120.0};
  std::map<std::pair<int, int>, std::pair<std::int64_t, std::int64_t>> counts;
  const std::vector<Event> events = watch(pixels, lamp, 1'000'000, 100);
  for (const Event& event : events) ++(event.on ? counts[{event.y, event.x}].first : counts[{event.y, event.x}].second);
  const cv::Mat thresholds = pixels.thresholds();
  Worst share{1.0};
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const auto own = thresholds.at<cv::Vec2f>(y, x);
      const auto [on, off] = counts[{y, x}];
      EXPECT_GT(on, 500);
      const double balance = static_cast<double>(on) * own[0] - static_cast<double>(off) * own[1];
      const double now = lamp.log_light(1e6) - std::log(1.0 + lamp.dark);
      EXPECT_LT(share(std::abs(balance - now) / std::max(own[0], own[1])), share.bar);
    }
  }
  did("{} events of 128 pixels of different thresholds in a second of a lamp that swings by 80 %: ON times its "
      "threshold less OFF times its own is the change of the light's logarithm, to {} of a threshold",
      events.size(), share.text());
}

// A first-order low-pass: a small swing comes through by 1 / sqrt(1 + (f / f3dB)^2).
TEST(HardCase45Pixels, ASlowPixelSeesLessOfIt) {
  Worst away{0.02};  // the swing is a hundredth: by as much the bandwidth changes within a cycle
  std::string gains;
  for (const double ratio : {0.3, 1.0, 4.0}) {
    const Lamp45 lamp{0.01, 100.0};
    EventPixelSettings settings = ideal();
    settings.bandwidth_hz = ratio * lamp.frequency_Hz;
    settings.reference_intensity = 1.0;
    EventPixels pixels(settings, {1, 1}, 1, 1);
    std::vector<Event> events;
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (std::int64_t t = 0; t <= 200'000; t += 20) {
      pixels.advance(flat(lamp.light(static_cast<double>(t))), t, events);
      if (t < 150'000) continue;
      const double v = pixels.photoreceptor_output().at<double>(0, 0);
      low = std::min(low, v);
      high = std::max(high, v);
    }
    const double gain = (high - low) / (lamp.highest() - lamp.lowest());
    const double wanted = 1.0 / std::hypot(1.0, 1.0 / ratio);
    EXPECT_LT(away(std::abs(gain / wanted - 1.0)), away.bar) << ratio;
    EXPECT_TRUE(events.empty());
    gains += fmt::format("{}{:.4f}", gains.empty() ? "" : ", ", gain);
  }
  did("pixels whose bandwidth is 0.3, 1 and 4 times the flicker's frequency: {} of its swing comes through, the "
      "low-pass "
      "in closed form to {}",
      gains, away.text("relative"));
}

TEST(HardCase45Pixels, ARealPixelIsBlindAfterEachEvent) {
  EventPixelSettings settings = davis240c(1.0);
  settings.shot_rate_hz = 50.0;
  ASSERT_GT(settings.refractory_us, 0);
  EventPixels pixels(settings, {8, 8}, 45, 2);
  const Lamp45 lamp{1.0, 100.0};
  const std::vector<Event> events = watch(pixels, lamp, 500'000, 50);
  std::map<std::pair<int, int>, std::int64_t> last;
  std::int64_t shortest_us = 1'000'000;
  for (const Event& event : events) {
    const auto [at, is_first] = last.try_emplace({event.y, event.x}, event.t_us);
    if (!is_first) shortest_us = std::min(shortest_us, event.t_us - at->second);
    at->second = event.t_us;
  }
  EXPECT_GE(shortest_us, settings.refractory_us);
  EXPECT_GT(events.size(), 64U * 50U) << "at least once a cycle";
  EXPECT_LT(events.size(), 64U * 500'000U / static_cast<std::size_t>(settings.refractory_us));
  did("pixels as the DAVIS 240C's, with noise, before a lamp that goes dark 100 times a second: {} events, no two of a "
      "pixel nearer than {} us (its refractory time is {} us)",
      events.size(), shortest_us, settings.refractory_us);
}

}  // namespace
}  // namespace touchstone::render
