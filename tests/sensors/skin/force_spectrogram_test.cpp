#include "sensors/skin/force_spectrogram.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "core/units.h"
#include "tests/support/message_of.h"

namespace touchstone::sensors {
namespace {

using test::message_of;
using ::testing::HasSubstr;

constexpr double kRate_Hz = 1000.0;
constexpr int kBefore = 100;  // samples without force

/// Nothing, then `mean` and a sinusoid.
std::vector<double> waveform(double mean, double amplitude, double frequency_Hz, int samples = 1200) {
  std::vector<double> force(kBefore, 0.0);
  for (int i = 0; i < samples; ++i) {
    force.push_back(mean + amplitude * std::sin(2.0 * kPi * frequency_Hz * i / kRate_Hz));
  }
  return force;
}

TEST(ForceSpectrogram, ShowsTheAmplitudeOfEachFrequency) {
  ForceSpectrogramSettings settings;
  settings.window_s = 0.1;  // lines 10 Hz apart
  settings.floor_N = 1e-6;
  const Eigen::VectorXd frequencies = spectrogram_frequencies(kRate_Hz, settings);
  ASSERT_EQ(frequencies.size(), 51);
  EXPECT_DOUBLE_EQ(frequencies[20], 200.0);
  const Eigen::MatrixXd picture = force_spectrogram(waveform(2.0, 0.3, 200.0), kRate_Hz, settings);
  ASSERT_EQ(picture.cols(), 21);  // 1 + (0.768 - 0.1) / 0.032
  const Eigen::VectorXd steady = picture.col(10).array().unaryExpr([](double x) { return std::pow(10.0, x); });
  EXPECT_NEAR(steady[0], 2.0, 1e-5);
  EXPECT_NEAR(steady[20], 0.3, 1e-5);
  EXPECT_NEAR(steady[21], 0.15, 1e-4) << "Hann's window halves the lines next to it";
  EXPECT_LT(steady[30], 1e-4);
}

TEST(ForceSpectrogram, TheLineAtHalfTheRateCountsOnce) {
  ForceSpectrogramSettings settings;
  settings.window_s = 0.1;
  std::vector<double> force(kBefore, 0.0);
  for (int i = 0; i < 1200; ++i) force.push_back(1.0 + (i % 2 == 0 ? 0.2 : -0.2));
  const Eigen::MatrixXd picture = force_spectrogram(force, kRate_Hz, settings);
  EXPECT_NEAR(picture(50, 5), std::log10(0.2 + settings.floor_N), 1e-6);
}

TEST(ForceSpectrogram, BeginsAtTheTouchWheneverThatIs) {
  const std::vector<double> force = waveform(1.0, 0.1, 30.0);
  std::vector<double> later(57, 0.0);
  later.push_back(5.0);  // a single sample is noise
  later.insert(later.end(), 20, 0.0);
  later.insert(later.end(), force.begin(), force.end());
  EXPECT_EQ(force_spectrogram(later, kRate_Hz), force_spectrogram(force, kRate_Hz));
}

TEST(ForceSpectrogram, HoldsTheLastForceBeyondTheEnd) {
  std::vector<double> force = waveform(1.0, 0.0, 1.0, 300);
  const Eigen::MatrixXd shorter = force_spectrogram(force, kRate_Hz);
  force.insert(force.end(), 900, 1.0);
  EXPECT_EQ(shorter, force_spectrogram(force, kRate_Hz));
}

TEST(ForceSpectrogram, DownsamplingFoldsWhatIsTooFast) {
  // 200 Hz at 250 Hz look like 50 Hz.
  ForceSpectrogramSettings settings;
  settings.window_s = 0.1;
  const std::vector<double> slow = downsampled(waveform(1.0, 0.3, 200.0), 4);
  const Eigen::MatrixXd picture = force_spectrogram(slow, kRate_Hz / 4, settings);
  EXPECT_NEAR(picture(5, 8), std::log10(0.3 + settings.floor_N), 1e-3);
  EXPECT_EQ(downsampled(std::vector<double>{1, 2, 3, 4, 5}, 2), (std::vector<double>{1, 3, 5}));
}

TEST(ForceSpectrogram, WhatMakesNoSenseIsRefused) {
  const std::vector<double> force = waveform(1.0, 0.0, 1.0);
  const auto message = [&](auto spoil) {
    ForceSpectrogramSettings settings;
    spoil(settings);
    return message_of([&] { force_spectrogram(force, kRate_Hz, settings); });
  };
  EXPECT_EQ(message([](auto&) {}), "no error");
  EXPECT_THAT(message([](auto& s) { s.window_s = 0.0; }), HasSubstr("window_s is 0"));
  EXPECT_THAT(message([](auto& s) { s.window_s = 0.002; }), HasSubstr("has 2 samples at 1000 Hz, it needs 4"));
  EXPECT_THAT(message([](auto& s) { s.length_s = 0.05; }), HasSubstr("it must be at least window_s"));
  EXPECT_THAT(message([](auto& s) { s.trigger_N = 3.0; }), HasSubstr("nothing was touched"));
  std::vector<double> broken = force;
  broken[7] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(message_of([&] { force_spectrogram(broken, kRate_Hz); }), HasSubstr("force 7 is nan"));
  EXPECT_THAT(message_of([&] { force_spectrogram(force, -1.0); }), HasSubstr("rate_Hz is -1"));
  EXPECT_THAT(message_of([&] { downsampled(force, 0); }), HasSubstr("downsampling by 0"));
}

}  // namespace
}  // namespace touchstone::sensors
