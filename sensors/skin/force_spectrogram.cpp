#include "sensors/skin/force_spectrogram.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "core/error.h"
#include "core/number_checks.h"
#include "core/units.h"

namespace touchstone::sensors {
namespace {

constexpr const char* kWhose = "force spectrogram: ";
constexpr int kLeastWindow = 4;
constexpr double kMostSamples = 1 << 24;  // of a window, and of the numbers of a picture

int window_samples(double rate_Hz, const ForceSpectrogramSettings& settings) {
  check_above_zero(kWhose, rate_Hz, "rate_Hz");
  check_above_zero(kWhose, settings.window_s, "window_s");
  check_above_zero(kWhose, settings.hop_s, "hop_s");
  check_above_zero(kWhose, settings.length_s, "length_s");
  check_above_zero(kWhose, settings.trigger_N, "trigger_N");
  check_at_least_zero(kWhose, settings.before_s, "before_s");
  check_above_zero(kWhose, settings.floor_N, "floor_N");
  // As numbers first: what is too many is beyond a whole number, too.
  const double windows = 1.0 + (settings.length_s - settings.window_s) / settings.hop_s;
  if (!(settings.window_s * rate_Hz <= kMostSamples && settings.length_s * rate_Hz <= 1e12 &&
        settings.before_s * rate_Hz <= 1e12 && windows * settings.window_s * rate_Hz <= kMostSamples)) {
    fail("{}windows of {} s, {} s apart, over {} s at {} Hz are too many; allowed are {} numbers in all", kWhose,
         settings.window_s, settings.hop_s, settings.length_s, rate_Hz, kMostSamples);
  }
  const long samples = std::lround(settings.window_s * rate_Hz);
  if (samples < kLeastWindow) {
    fail("{}a window of {} s has {} samples at {} Hz, it needs {}", kWhose, settings.window_s, samples, rate_Hz,
         kLeastWindow);
  }
  if (settings.length_s < settings.window_s) {
    fail("{}length_s is {}, it must be at least window_s, {}", kWhose, settings.length_s, settings.window_s);
  }
  return static_cast<int>(samples);
}

std::size_t touch_of(std::span<const double> force_N, double trigger_N) {
  int above = 0;
  for (std::size_t i = 0; i < force_N.size(); ++i) {
    above = force_N[i] > trigger_N ? above + 1 : 0;
    if (above == kTriggerSamples) return i + 1 - kTriggerSamples;
  }
  fail("{}the force never stays above {} N: nothing was touched", kWhose, trigger_N);
}

}  // namespace

Eigen::VectorXd spectrogram_frequencies(double rate_Hz, const ForceSpectrogramSettings& settings) {
  const int samples = window_samples(rate_Hz, settings);
  Eigen::VectorXd frequencies(samples / 2 + 1);
  for (Eigen::Index k = 0; k < frequencies.size(); ++k) frequencies[k] = static_cast<double>(k) * rate_Hz / samples;
  return frequencies;
}

Eigen::MatrixXd force_spectrogram(std::span<const double> force_N, double rate_Hz,
                                  const ForceSpectrogramSettings& settings) {
  const int samples = window_samples(rate_Hz, settings);
  for (std::size_t i = 0; i < force_N.size(); ++i) {
    if (!std::isfinite(force_N[i])) fail("{}force {} is {}, it must be finite", kWhose, i, force_N[i]);
  }
  const auto touch = static_cast<long>(touch_of(force_N, settings.trigger_N));
  const long begin = touch - std::lround(settings.before_s * rate_Hz);
  std::vector<double> hann(static_cast<std::size_t>(samples));
  double sum = 0.0;
  for (int i = 0; i < samples; ++i) {
    hann[static_cast<std::size_t>(i)] = 0.5 - 0.5 * std::cos(2.0 * kPi * (i + 0.5) / samples);
    sum += hann[static_cast<std::size_t>(i)];
  }
  const int windows = 1 + static_cast<int>(std::floor((settings.length_s - settings.window_s) / settings.hop_s + 1e-9));
  Eigen::MatrixXd picture(samples / 2 + 1, windows);
  cv::Mat_<double> weighted(1, samples);
  cv::Mat_<cv::Vec2d> spectrum;
  for (int w = 0; w < windows; ++w) {
    const long first = begin + std::lround(w * settings.hop_s * rate_Hz);
    for (int i = 0; i < samples; ++i) {
      const long at = std::clamp(first + i, 0L, static_cast<long>(force_N.size()) - 1);
      weighted(0, i) = hann[static_cast<std::size_t>(i)] * force_N[static_cast<std::size_t>(at)];
    }
    cv::dft(weighted, spectrum, cv::DFT_COMPLEX_OUTPUT);
    for (Eigen::Index k = 0; k < picture.rows(); ++k) {
      const cv::Vec2d& value = spectrum(0, static_cast<int>(k));
      // The line at half the rate is its own mirror image, as that at 0 is.
      const double sides = k == 0 || 2 * k == samples ? 1.0 : 2.0;
      picture(k, w) = std::log10(sides * std::hypot(value[0], value[1]) / sum + settings.floor_N);
    }
  }
  return picture;
}

std::vector<double> downsampled(std::span<const double> force_N, int factor) {
  if (factor < 1) fail("downsampling by {}; it must be at least 1", factor);
  std::vector<double> kept;
  for (std::size_t i = 0; i < force_N.size(); i += static_cast<std::size_t>(factor)) kept.push_back(force_N[i]);
  return kept;
}

}  // namespace touchstone::sensors
