// The hard case of mains flicker, 45, for who estimates forces from counts of events: lamps whose light swings at 100
// Hz or 120 Hz add events of their own to those of a touch.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>
#include <vector>

#include "core/random.h"
#include "core/units.h"
#include "sensors/events/event_windows.h"
#include "sensors/events/mains_flicker.h"
#include "sensors/events/time_delay_network.h"
#include "tests/hard_cases/hard_case.h"
#include "tests/sensors/events/synthetic_grasps.h"
#include "tests/support/message_of.h"

namespace touchstone::sensors {
namespace {

using test::did;
using test::message_of;
using test::Worst;
using ::testing::HasSubstr;

constexpr int kPixels = 200;
constexpr double kThreshold = 0.2;  // of ON and OFF, natural logarithm

/// Light 1 + depth sin(2 pi f t).
struct Flicker {
  double depth = 0.0;
  double frequency_Hz = 100.0;
};

void sort(std::vector<Event>& events) {
  std::sort(events.begin(), events.end(), [](const Event& a, const Event& b) { return a.t_us < b.t_us; });
}

/// Events of pixels that settled in the light: each has a ladder of levels a threshold apart in the logarithm, ON where
/// the light rises to one and OFF where it falls to one, but for the end that it comes from.
std::vector<Event> events_of(const Flicker& flicker, double seconds) {
  std::vector<Event> events;
  RandomStream random(45, 0, Purpose::kTest);
  const double low = std::log1p(-flicker.depth);
  const double high = std::log1p(flicker.depth);
  for (int pixel = 0; pixel < kPixels; ++pixel) {
    std::vector<double> ladder;
    for (double at = low + kThreshold * random.uniform(); at <= high; at += kThreshold) ladder.push_back(at);
    const auto add = [&](double level, bool on) {
      const double rise = std::asin(std::expm1(level) / flicker.depth) / (2.0 * kPi);  // of a period
      for (double period = on ? rise : 0.5 - rise; period < seconds * flicker.frequency_Hz; period += 1.0) {
        const auto t_us = static_cast<std::int64_t>(std::floor(1e6 * period / flicker.frequency_Hz));
        if (t_us >= 0) events.push_back({t_us, static_cast<std::uint16_t>(pixel), 0, on});
      }
    };
    for (std::size_t k = 1; k < ladder.size(); ++k) add(ladder[k], true);
    for (std::size_t k = 0; k + 1 < ladder.size(); ++k) add(ladder[k], false);
  }
  sort(events);
  return events;
}

/// The events of windows, spread evenly at random over each.
std::vector<Event> spread(std::span<const EventCounts> windows, std::int64_t length_us) {
  RandomStream random(45, 1, Purpose::kTest);
  std::vector<Event> events;
  for (std::size_t i = 0; i < windows.size(); ++i) {
    const auto add = [&](std::int64_t count, bool on) {
      for (std::int64_t k = 0; k < count; ++k) {
        const double at = (static_cast<double>(i) + random.uniform()) * static_cast<double>(length_us);
        events.push_back({static_cast<std::int64_t>(at), 0, 0, on});
      }
    };
    add(windows[i].on, true);
    add(windows[i].off, false);
  }
  sort(events);
  return events;
}

std::vector<int> range(int begin, int end) {
  std::vector<int> indices(static_cast<std::size_t>(end - begin));
  std::iota(indices.begin(), indices.end(), begin);
  return indices;
}

/// What became of one grasp.
struct Outcome {
  double worst_N = 0.0;   ///< largest error of the forces that nothing was said of
  double called_N = 0.0;  ///< largest error of those that something was said of
  bool flicker = false;   ///< found before the touch
  int guesses = 0;        ///< forces that were called guesses
  int forces = 0;
  std::string refusal;
};

Outcome outcome_of(const TimeDelayNetwork& model, const SyntheticGrasp& grasp, std::int64_t length_us,
                   const Flicker& flicker) {
  std::vector<Event> events = spread(grasp.windows, length_us);
  const double seconds = 1e-6 * static_cast<double>(length_us) * static_cast<double>(grasp.windows.size());
  if (flicker.depth > 0.0) {
    const std::vector<Event> more = events_of(flicker, seconds);
    events.insert(events.end(), more.begin(), more.end());
    sort(events);
  }
  Outcome outcome;
  EventWindowSettings settings;
  settings.length_us = length_us;
  const std::vector<EventCounts> windows =
      count_windows(events, settings, length_us * static_cast<std::int64_t>(grasp.windows.size()));
  const GraspPhaseSettings phase_settings;
  MainsFlickerMeter meter;
  const auto is_before = [&](const Event& event) { return event.t_us < phase_settings.background_windows * length_us; };
  meter.add(std::span(events).first(
      static_cast<std::size_t>(std::partition_point(events.begin(), events.end(), is_before) - events.begin())));
  outcome.flicker = meter.flicker().found();
  GraspPhases phases;
  outcome.refusal = message_of([&] { phases = find_grasp_phases(windows, phase_settings); });
  if (outcome.refusal != "no error") return outcome;
  outcome.refusal.clear();
  const GraspSequence sequence = grasp_sequence(windows, phases, length_us);
  TimeDelayEstimator estimator(model);
  std::size_t judged = 0;
  for (int row = 0; row < sequence.counts.rows(); ++row) {
    const double features[] = {sequence.counts(row, 0), sequence.counts(row, 1)};
    const double force_N = estimator.next(features);
    EXPECT_TRUE(std::isfinite(force_N));
    if (judged == sequence.judged.size() || sequence.judged[judged] != row) continue;
    ++judged;
    ++outcome.forces;
    outcome.guesses += estimator.extrapolates() ? 1 : 0;
    double& worst_N = outcome.flicker || estimator.extrapolates() ? outcome.called_N : outcome.worst_N;
    worst_N = std::max(worst_N, std::abs(force_N - grasp.force_N[phases.first_touch + row]));
  }
  return outcome;
}

TEST(HardCase45Estimators, AForceUnderFlickerIsRightOrCalledWrong) {
  std::vector<ForceSeries> series;
  for (int i = 0; i < 26; ++i) series.push_back(synthetic_series(synthetic_grasp(i, 1), false));
  TimeDelayNetworkSettings settings;
  settings.hidden_layers = 1;
  settings.units = 8;
  settings.training.most_steps = 60;
  const TimeDelayNetwork model = train_time_delay_network(series, range(0, 22), range(22, 26), settings).model;
  double without_N = 0.0;
  int guesses = 0, forces = 0;
  constexpr int kFirst = 26, kLast = 38;  // grasps that it hasn't seen
  for (int i = kFirst; i < kLast; ++i) {
    const Outcome outcome = outcome_of(model, synthetic_grasp(i, 1), 7000, {});
    EXPECT_EQ(outcome.refusal, "");
    EXPECT_FALSE(outcome.flicker);
    guesses += outcome.guesses;
    forces += outcome.forces;
    without_N = std::max(without_N, outcome.worst_N);
  }
  EXPECT_LT(guesses, forces / 4) << "few grasps are quite like one that was learnt";
  Worst silent{2.0 * without_N};
  int grasps = 0, found = 0, refused = 0, unmarked = 0;
  double least_found = 1.0, called_N = 0.0;
  for (const double frequency_Hz : {100.0, 120.0, 119.6}) {
    for (const std::int64_t length_us : {7000, 10000}) {
      for (const double depth : {0.005, 0.1005, 0.101, 0.102, 0.103, 0.105, 0.11, 0.15, 0.6}) {
        for (int i = kFirst; i < kFirst + 2; ++i) {
          const Outcome outcome = outcome_of(model, synthetic_grasp(i, 1), length_us, {depth, frequency_Hz});
          EXPECT_LE(silent(outcome.worst_N), silent.bar) << frequency_Hz << " Hz, " << length_us << " us, " << depth;
          called_N = std::max(called_N, outcome.called_N);
          ++grasps;
          found += outcome.flicker ? 1 : 0;
          refused += outcome.refusal.empty() ? 0 : 1;
          if (outcome.flicker) least_found = std::min(least_found, depth);
          if (!outcome.flicker && outcome.refusal.empty()) {
            ++unmarked;
            EXPECT_LT(depth, 0.11) << "flicker of a tenth of the light and more is always seen";
          }
        }
      }
    }
  }
  EXPECT_GT(unmarked, 0);
  EXPECT_GT(called_N, silent.bar) << "flicker that spoils no force is no hard case";
  did("time delay network: {} grasps under light that swings by 0.5 % to 60 % at 100, 119.6 and 120 Hz, in "
      "windows of 7 and 10 ms: flicker is found before the touch in {}, from a swing of {} on; {} are refused as "
      "grasps; forces that nothing is said of are wrong by {} (twice what they are without flicker), others by up to "
      "{:.2g} N",
      grasps, found, least_found, refused, silent.text("N"), called_N);
}

TEST(HardCase45Estimators, NoiseAndATouchAreNoFlicker) {
  int called = 0;
  double least_chance = 1.0;
  constexpr int kRecordings = 300;
  for (int i = 0; i < kRecordings; ++i) {
    RandomStream random(45, 100 + static_cast<std::uint64_t>(i), Purpose::kTest);
    std::vector<Event> events;
    for (double t = 0.0;;) {
      t -= 1e6 / (i % 2 == 0 ? 300.0 : 30000.0) * std::log1p(-random.uniform());
      if (t > 600'000.0) break;
      events.push_back({static_cast<std::int64_t>(t), 0, 0, random.uniform() < 0.5});
    }
    MainsFlickerMeter meter;
    meter.add(events);
    called += meter.flicker().found() ? 1 : 0;
    least_chance = std::min(least_chance, meter.flicker().chance);
  }
  EXPECT_EQ(called, 0);
  EXPECT_GT(least_chance, 0.01 / kRecordings) << "a chance is a chance";
  // A touch, whose events come in one burst of 154 ms.
  MainsFlickerMeter touch;
  touch.add(spread(synthetic_grasp(0, 1).windows, 7000));
  EXPECT_FALSE(touch.flicker().found());
  const std::string said = message_of([&] { touch.add(std::vector<Event>{{0, 0, 0, true}}); });
  EXPECT_THAT(said, HasSubstr("times must not go backwards"));
  EXPECT_FALSE(MainsFlickerMeter().flicker().found());
  did("flicker meter: of {} recordings of noise none is called flicker, the least likely has a chance of {:.2g}; a "
      "whole "
      "grasp has a share of {:.2g} (allowed 0.1)",
      kRecordings, least_chance, touch.flicker().share);
}

TEST(HardCase45Estimators, AFeatureOutsideOfTrainingIsCalledSo) {
  std::vector<ForceSeries> series;
  for (int i = 0; i < 3; ++i) series.push_back(synthetic_series(synthetic_grasp(i, 1), false));
  TimeDelayNetworkSettings settings;
  settings.hidden_layers = 1;
  settings.units = 3;
  settings.training.most_steps = 5;
  const TimeDelayNetwork model = train_time_delay_network(series, range(0, 3), {}, settings).model;
  TimeDelayEstimator estimator(model);
  const double inside[] = {model.features.high[0], model.features.high[1]};
  const double outside[] = {model.features.high[0], model.features.high[1] * 1.001};
  std::vector<bool> said;
  for (const auto& features : {inside, outside, inside, inside, inside}) {
    estimator.next(std::span(features, 2));
    said.push_back(estimator.extrapolates());
  }
  EXPECT_EQ(said, (std::vector<bool>{false, true, true, true, false})) << "as long as it is looked at";
  estimator.next(outside);
  estimator.begin();
  EXPECT_FALSE(estimator.extrapolates());
  did("time delay network: a window 0.1 % beyond the counts of training makes the three forces that look at it "
      "guesses");
}

}  // namespace
}  // namespace touchstone::sensors
