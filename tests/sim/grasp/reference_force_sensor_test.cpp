#include "sim/grasp/reference_force_sensor.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "core/error.h"

namespace touchstone::sim {
namespace {

using ::testing::HasSubstr;

constexpr double kDt = 1e-3;

/// Moments a millisecond apart under a force that depends on time.
std::vector<FingerMoment> under(double seconds, const std::function<double(double)>& force) {
  std::vector<FingerMoment> moments;
  for (int k = 0; k * kDt <= seconds; ++k) {
    FingerMoment moment;
    moment.seconds = k * kDt;
    moment.force_N = force(moment.seconds);
    moments.push_back(moment);
  }
  return moments;
}

/// The sensor without any of its errors.
ReferenceForceSensorSettings ideal_force_sensor() {
  ReferenceForceSensorSettings ideal;
  ideal.hysteresis = ideal.gain_error = ideal.drift_per_decade = ideal.lag_s = 0.0;
  ideal.noise_N = ideal.carried_g = ideal.shaken_N_s_mm = 0.0;
  ideal.adc_bits = 0;
  ideal.median = 1;
  return ideal;
}

TEST(ReferenceForceSensor, WithoutErrorsTellsTheForce) {
  const auto moments = under(1.0, [](double t) { return 3.0 * t; });
  const auto readings = read_reference_force(moments, 0.1, ideal_force_sensor(), 1);
  ASSERT_EQ(readings.size(), 128u);  // windows of 7 ms in 0.9 s
  for (const ForceReading& r : readings) {
    EXPECT_NEAR(r.raw_N, 3.0 * r.seconds, 2e-3);  // read at the window's end, within half a moment
    EXPECT_NEAR(r.true_N, 3.0 * (r.seconds - 0.0035), 2e-3);
    EXPECT_EQ(r.measured_N, r.raw_N);
  }
  EXPECT_NEAR(readings.front().seconds, 0.107, 1e-12);
}

TEST(HysteresisLoop, IsAsWideAsAskedForWhateverThePeak) {
  for (const double peak : {0.3, 1.0, 3.7, 8.0}) {
    HysteresisLoop loop(0.045, 3.7);
    for (int k = 0; k <= 1000; ++k) loop.next(peak * k / 1000);
    const double top = loop.next(peak);
    for (int k = 1000; k >= 0; --k) loop.next(peak * k / 1000);
    EXPECT_NEAR(loop.next(0.0) / top, 0.045, 0.002) << peak;
  }
}

TEST(HysteresisLoop, FirstLoadingIsWithinTheSheetsLinearity) {
  HysteresisLoop loop(0.045, 3.7);
  double worst = 0.0;
  for (int k = 0; k <= 1000; ++k) worst = std::max(worst, std::abs(loop.next(3.7 * k / 1000) - 3.7 * k / 1000));
  EXPECT_LT(worst, 0.03 * 3.7);
  EXPECT_GT(worst, 0.015 * 3.7);
}

TEST(HysteresisLoop, LoopsAreClosedAndForgetWhatWasInThem) {
  HysteresisLoop with(0.045, 3.7);
  HysteresisLoop without(0.045, 3.7);
  const auto go = [](HysteresisLoop& loop, double from, double to) {
    double value = 0.0;
    for (int k = 0; k <= 200; ++k) value = loop.next(from + (to - from) * k / 200);
    return value;
  };
  go(with, 0.0, 2.0);
  const double there = go(without, 0.0, 2.0);
  const double low = go(with, 2.0, 1.0);
  EXPECT_GT(low, 1.0 * there / 2.0) << "on unloading it reads more";
  EXPECT_NEAR(go(with, 1.0, 2.0), there, 1e-12) << "an inner loop closes";
  EXPECT_NEAR(go(with, 2.0, 3.0), go(without, 2.0, 3.0), 1e-12) << "and leaves nothing behind";
  HysteresisLoop none(0.0, 3.7);
  for (const double force : {1.0, 2.5, 0.7, 0.0}) EXPECT_EQ(none.next(force), force);
}

TEST(ReferenceForceSensor, DriftsByItsShareADecade) {
  ReferenceForceSensorSettings settings = ideal_force_sensor();
  settings.drift_per_decade = 0.05;
  settings.window_s = 0.1;
  const auto readings = read_reference_force(under(10.0, [](double) { return 2.0; }), 0.0, settings, 1);
  const auto at = [&](double seconds) {
    return readings[static_cast<std::size_t>(std::lround(seconds / 0.1)) - 1].raw_N;
  };
  EXPECT_NEAR(at(1.0), 2.0, 2e-3) << "right after a second";
  EXPECT_NEAR(at(9.9) / at(1.0) - 1.0, 0.05, 0.01);
}

TEST(ReferenceForceSensor, LagsBehindAForceThatGoes) {
  ReferenceForceSensorSettings settings = ideal_force_sensor();
  settings.lag_s = 0.020;
  const auto readings =
      read_reference_force(under(0.5, [](double t) { return t < 0.3005 ? 2.0 : 0.0; }), 0.0, settings, 1);
  for (const ForceReading& r : readings) {
    if (r.seconds < 0.31) continue;
    EXPECT_NEAR(r.raw_N, 2.0 * std::exp(-(r.seconds - 0.3) / 0.020), 0.02) << r.seconds;
  }
}

TEST(ReferenceForceSensor, ReadsInTheConvertersSteps) {
  ReferenceForceSensorSettings settings = ideal_force_sensor();
  settings.adc_bits = 10;
  const double step = 111.0 / 1023;
  for (const ForceReading& r : read_reference_force(under(1.0, [](double t) { return 3.0 * t; }), 0.0, settings, 1)) {
    EXPECT_NEAR(r.raw_N / step, std::round(r.raw_N / step), 1e-9);
    EXPECT_LE(std::abs(r.raw_N - 3.0 * r.seconds), 0.5 * step + 2e-3);
  }
}

TEST(ReferenceForceSensor, EachGraspHasItsGain) {
  ReferenceForceSensorSettings settings = ideal_force_sensor();
  settings.gain_error = 0.025;
  const auto moments = under(0.1, [](double) { return 2.0; });
  double least = 2.0;
  double most = 2.0;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    const double read = read_reference_force(moments, 0.0, settings, seed).back().raw_N;
    least = std::min(least, read);
    most = std::max(most, read);
  }
  EXPECT_GE(least, 2.0 * 0.975);
  EXPECT_LE(most, 2.0 * 1.025);
  EXPECT_LT(least, 2.0 * 0.98);
  EXPECT_GT(most, 2.0 * 1.02);
}

TEST(ReferenceForceSensor, FeelsTheFingersMotion) {
  ReferenceForceSensorSettings settings = ideal_force_sensor();
  settings.carried_g = 10.0;
  auto moments = under(0.5, [](double) { return 0.0; });
  for (FingerMoment& m : moments) m.acceleration_mm_s2 = 20e3;
  EXPECT_NEAR(read_reference_force(moments, 0.0, settings, 1).back().raw_N, 0.2, 1e-9) << "10 g at 20 m/s^2";

  settings = ideal_force_sensor();
  settings.shaken_N_s_mm = 0.002;
  auto moving = under(7.0, [](double) { return 1.0; });
  for (FingerMoment& m : moving) m.speed_mm_s = m.seconds < 3.5 ? 0.0 : -40.0;
  double square = 0.0;
  int count = 0;
  for (const ForceReading& r : read_reference_force(moving, 0.0, settings, 1)) {
    if (r.seconds < 3.49) {
      EXPECT_EQ(r.raw_N, 1.0) << "at rest nothing is added";
    } else if (r.seconds > 3.51) {
      square += std::pow(r.raw_N - 1.0, 2);
      ++count;
    }
  }
  EXPECT_NEAR(std::sqrt(square / count), 0.08, 0.012);  // of 498 readings: 3 % scatter
}

TEST(ReferenceForceSensor, MedianTakesSingleReadingsOut) {
  ReferenceForceSensorSettings settings = ideal_force_sensor();
  settings.noise_N = 0.1;
  settings.median = 3;
  const auto readings = read_reference_force(under(1.0, [](double) { return 2.0; }), 0.0, settings, 5);
  double raw = 0.0;
  double filtered = 0.0;
  for (std::size_t k = 1; k + 1 < readings.size(); ++k) {
    std::array<double, 3> around = {readings[k - 1].raw_N, readings[k].raw_N, readings[k + 1].raw_N};
    std::sort(around.begin(), around.end());
    EXPECT_EQ(readings[k].measured_N, around[1]);
    raw += std::pow(readings[k].raw_N - 2.0, 2);
    filtered += std::pow(readings[k].measured_N - 2.0, 2);
  }
  EXPECT_LT(filtered, 0.6 * raw);  // the variance of a median of three normal numbers is 0.449
}

TEST(ReferenceForceSensor, TheSameSeedGivesTheSameReadings) {
  const auto moments = under(1.0, [](double t) { return 2.0 * std::sin(3.0 * t); });
  const auto one = read_reference_force(moments, 0.0, {}, 7);
  const auto two = read_reference_force(moments, 0.0, {}, 7);
  for (std::size_t k = 0; k < one.size(); ++k) EXPECT_EQ(one[k].measured_N, two[k].measured_N);
}

TEST(ReferenceForceSensor, WhatMakesNoSenseIsRefused) {
  const auto moments = under(0.1, [](double) { return 1.0; });
  const auto expect_refused = [](const char* words, const std::vector<FingerMoment>& given, double from,
                                 const std::function<void(ReferenceForceSensorSettings&)>& change) {
    ReferenceForceSensorSettings settings;
    change(settings);
    try {
      read_reference_force(given, from, settings, 1);
      ADD_FAILURE() << "not refused: " << words;
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), HasSubstr(words));
    }
  };
  const auto nothing = [](ReferenceForceSensorSettings&) {};
  expect_refused("at least two moments", {moments.front()}, 0.0, nothing);
  auto uneven = moments;
  uneven[5].seconds += 1e-4;
  expect_refused("aren't even in time", uneven, 0.0, nothing);
  expect_refused("no window", moments, 0.095, nothing);
  expect_refused("no window", moments, -1.0, nothing);
  expect_refused("must be odd", moments, 0.0, [](auto& s) { s.median = 4; });
  expect_refused("hysteresis is 0.5", moments, 0.0, [](auto& s) { s.hysteresis = 0.5; });
  expect_refused("noise_N is nan", moments, 0.0, [](auto& s) { s.noise_N = NAN; });
  EXPECT_THROW(HysteresisLoop(0.6, 1.0), Error);
  EXPECT_THROW(HysteresisLoop(0.1, 0.0), Error);
}

}  // namespace
}  // namespace touchstone::sim
