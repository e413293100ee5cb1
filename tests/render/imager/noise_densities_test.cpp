// Random numbers of imagers and event pixels against their distributions, by chi-squared.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "core/random.h"
#include "render/imager/imager_presets.h"
#include "render/sampling/noise_quantile.h"
#include "tests/render/events/event_light.h"
#include "tests/support/chi_squared.h"

namespace touchstone::render {
namespace {

using Point = std::pair<double, double>;

/// Share of a normal distribution below x.
double normal_below(double x) {
  return 0.5 * std::erfc(-x / std::sqrt(2.0));
}

/// Chances of 0, 1, 2 ... of a Poisson distribution, until nothing is left.
std::vector<double> poisson_chances(double mean) {
  std::vector<double> chances;
  const auto last = static_cast<int>(mean + 10.0 * std::sqrt(mean) + 20.0);
  for (int k = 0; k <= last; ++k) {
    chances.push_back(mean > 0.0 ? std::exp(k * std::log(mean) - mean - std::lgamma(k + 1.0)) : (k == 0 ? 1.0 : 0.0));
  }
  return chances;
}

TEST(NoiseDensities, NormalQuantile) {
  RandomStream stream(400, 0, Purpose::kTest);
  std::vector<double> counts(102, 0.0);
  std::vector<double> expected(102, 0.0);
  constexpr int kCount = 400000;
  const auto low = [](int bin) { return -5.0 + 0.1 * (bin - 1); };  // bin 0 is all below -5, 101 all above 5
  for (int i = 0; i < kCount; ++i) {
    counts[std::clamp(static_cast<int>(std::floor((normal_quantile(stream.uniform()) + 5.0) / 0.1)) + 1, 0, 101)] += 1;
  }
  for (int bin = 0; bin < 102; ++bin) {
    const double below = bin == 0 ? 0.0 : normal_below(low(bin));
    const double upto = bin == 101 ? 1.0 : normal_below(low(bin + 1));
    expected[bin] = kCount * (upto - below);
  }
  expect_counts(counts, expected);
}

TEST(NoiseDensities, PoissonQuantile) {
  std::uint64_t seed = 410;
  for (const double mean : {0.01, 0.8, 7.0, 31.9, 32.0, 60.0, 400.0, 3000.0}) {
    SCOPED_TRACE(mean);
    std::vector<double> expected = poisson_chances(mean);
    std::vector<double> counts(expected.size(), 0.0);
    constexpr int kCount = 200000;
    RandomStream stream(++seed, 0, Purpose::kTest);
    for (int i = 0; i < kCount; ++i) {
      const auto drawn = static_cast<std::size_t>(poisson_quantile(mean, stream.uniform()));
      counts[std::min(drawn, counts.size() - 1)] += 1.0;
    }
    for (double& value : expected) value *= kCount;
    expect_counts(counts, expected);
  }
}

TEST(NoiseDensities, StreamsPoissonAndNormal) {
  for (const double mean : {0.3, 9.0, 15.0, 200.0}) {
    SCOPED_TRACE(mean);
    std::vector<double> expected = poisson_chances(mean);
    std::vector<double> counts(expected.size(), 0.0);
    constexpr int kCount = 100000;
    RandomStream stream(420, static_cast<std::uint64_t>(mean), Purpose::kTest);
    for (int i = 0; i < kCount; ++i) {
      counts[std::min(static_cast<std::size_t>(stream.poisson(mean)), counts.size() - 1)] += 1.0;
    }
    for (double& value : expected) value *= kCount;
    expect_counts(counts, expected);
  }
  RandomStream stream(421, 0, Purpose::kTest);
  expect_samples(
      [&]() -> std::optional<Point> { return Point(normal_below(stream.normal()), normal_below(stream.normal())); },
      [](double, double) { return 1.0; });
}

// Numbers of an imager: Poisson electrons, cut at the full well, Gaussian read noise, gain, rounding, the ends of the
// range. Each preset in the dark, in little light and near saturation.
TEST(NoiseDensities, NumbersOfEveryImager) {
  for (const auto& name : imager_preset_names()) {
    const ImagerPreset preset = imager_preset(name, 1e-3);
    const Imager& imager = preset.imager;
    const ImagerResponse response = response_of(imager);
    const int channel = imager.bayer == BayerPattern::none ? 0 : channel_of(imager.bayer, 0, 0);
    const cv::Size size(400, 400);
    const FixedPattern pattern = {cv::Mat(size, CV_32FC1, cv::Scalar(1.0)), cv::Mat(size, CV_32FC1, cv::Scalar(0.0))};
    const int numbers = 1 << imager.bits;
    // The middle one lies between two numbers, so that also steps wider than the noise are distinguished.
    const double between = (std::floor(0.02 * numbers) + 0.5 - imager.black_level_DN) / imager.gain_DN_per_e;
    for (const double electrons : {0.0, std::max(between, 0.5 / imager.gain_DN_per_e), 0.97 * imager.full_well_e}) {
      SCOPED_TRACE(testing::Message() << name << " at " << electrons << " electrons");
      cv::Mat light(size, CV_32FC3, cv::Scalar::all(0.0));
      const auto irradiance = static_cast<float>(electrons / response.electrons_per_irradiance(channel, 1));
      light.forEach<cv::Vec3f>([&](cv::Vec3f& pixel, const int*) { pixel[1] = irradiance; });
      const cv::Mat raw = expose(light, imager, pattern, 31, 1);
      std::vector<double> counts(numbers, 0.0);
      double pixels = 0.0;
      for (int row = 0; row < size.height; ++row) {
        for (int column = 0; column < size.width; ++column) {
          if (imager.bayer != BayerPattern::none && channel_of(imager.bayer, column, row) != channel) continue;
          counts[raw.type() == CV_8UC1 ? raw.at<std::uint8_t>(row, column) : raw.at<std::uint16_t>(row, column)] += 1.0;
          pixels += 1.0;
        }
      }
      std::vector<double> expected(numbers, 0.0);
      const std::vector<double> chances = poisson_chances(electrons + response.dark_e);
      for (std::size_t k = 0; k < chances.size(); ++k) {
        if (chances[k] < 1e-13) continue;
        const double kept = std::min(static_cast<double>(k), imager.full_well_e);
        const double centre = imager.black_level_DN + imager.gain_DN_per_e * kept;
        const double spread = imager.gain_DN_per_e * imager.read_noise_e;
        const int first = std::max(0, static_cast<int>(centre - 8.0 * spread - 1.0));
        const int last = std::min(numbers - 1, static_cast<int>(centre + 8.0 * spread + 2.0));
        for (int number = first; number <= last; ++number) {
          const double below = number == 0 ? 0.0 : normal_below((number - 0.5 - centre) / spread);
          const double upto = number == numbers - 1 ? 1.0 : normal_below((number + 0.5 - centre) / spread);
          expected[number] += pixels * chances[k] * (upto - below);
        }
      }
      if (const auto most = std::max_element(expected.begin(), expected.end()); *most > pixels - 1e-3) {
        EXPECT_EQ(counts[most - expected.begin()], pixels) << "one number only";
      } else {
        expect_counts(counts, expected);
      }
    }
  }
}

// Waits between a pixel's noise events are exponential at the rate that its light allows.
TEST(NoiseDensities, WaitsOfEventNoise) {
  EventPixelSettings settings = ideal();
  settings.shot_rate_hz = 20.0;
  settings.shot_half_intensity = 3.0;
  const cv::Size size(160, 120);
  for (const double light : {0.0, 3.0, 9.0}) {
    SCOPED_TRACE(light);
    const double rate = 20.0 / (1.0 + light / 3.0);
    EventPixels pixels(settings, size, 1, 79);
    const std::vector<Event> events = watch(
        pixels, [light](double) { return light; }, 0, 3000000, 1000);
    cv::Mat last = cv::Mat::zeros(size, CV_64F);
    cv::Mat seen = cv::Mat::zeros(size, CV_32S);
    std::vector<double> first(50, 0.0);
    std::vector<double> second(50, 0.0);
    // Of the first two waits that both end in time: tested as one minus the share left, which is even over (0, 1) but
    // for the end of the time: at 3 s and 5 Hz, 15 mean waits, fewer than 1 in 1e5 are cut.
    for (const Event& event : events) {
      const int number = seen.at<int>(event.y, event.x)++;
      if (number > 1) continue;
      const double wait = 1e-6 * static_cast<double>(event.t_us) - last.at<double>(event.y, event.x);
      last.at<double>(event.y, event.x) = 1e-6 * static_cast<double>(event.t_us);
      auto& counts = number == 0 ? first : second;
      counts[std::clamp(static_cast<int>(50.0 * -std::expm1(-rate * wait)), 0, 49)] += 1.0;
    }
    expect_counts(first, std::vector<double>(50, size.area() / 50.0));
    expect_counts(second, std::vector<double>(50, size.area() / 50.0));
  }
}

}  // namespace
}  // namespace touchstone::render
