#include "sim/relief/relief_tile.h"

#include <array>
#include <opencv2/core.hpp>
#include <utility>

#include "core/error.h"
#include "core/units.h"

namespace touchstone::sim {
namespace {

int points_of(double size_mm) {
  // A side whose Fourier transform is quick.
  return cv::getOptimalDFTSize(std::max(2, static_cast<int>(std::ceil(size_mm / kTilePitch - 1e-9))));
}

/// Waves a millimetre of index k of n points.
double wave_number(int k, int n, double spacing) {
  return (k <= n / 2 ? k : k - n) / (n * spacing);
}

/// Multiplies each wave of `values` by `factor` of its wave vector.
template <typename Factor>
void filter(cv::Mat& values, const Eigen::Vector2d& spacing, Factor&& factor) {
  cv::Mat waves;
  cv::dft(values, waves, cv::DFT_COMPLEX_OUTPUT);
  for (int j = 0; j < waves.rows; ++j) {
    auto* row = waves.ptr<cv::Vec2f>(j);
    const double y = wave_number(j, waves.rows, spacing.y());
    for (int i = 0; i < waves.cols; ++i) {
      row[i] *= static_cast<float>(factor(Eigen::Vector2d(wave_number(i, waves.cols, spacing.x()), y)));
    }
  }
  cv::dft(waves, values, cv::DFT_INVERSE | cv::DFT_SCALE | cv::DFT_REAL_OUTPUT);
}

}  // namespace

ReliefTile::ReliefTile(Eigen::Vector2d size_mm, float height)
    : nx(points_of(size_mm.x())), ny(points_of(size_mm.y())), spacing(size_mm.x() / nx, size_mm.y() / ny) {
  TS_ASSERT(size_mm.minCoeff() > 0.0);
  heights.assign(static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny), height);
}

fem::ReliefMap ReliefTile::map() const {
  const float lowest = *std::min_element(heights.begin(), heights.end());
  std::vector<float> above = heights;
  for (float& height : above) height -= lowest;
  return {nx, ny, Eigen::Vector2d::Zero(), spacing, {true, true}, std::move(above)};
}

RandomStream relief_stream(std::uint64_t seed, std::uint64_t part) {
  return {seed, part, Purpose::kRelief};
}

std::vector<float> random_field(const ReliefTile& tile, const std::function<double(const Eigen::Vector2d&)>& power,
                                RandomStream& random) {
  cv::Mat values(tile.ny, tile.nx, CV_32FC1);
  for (int j = 0; j < tile.ny; ++j) {
    for (int i = 0; i < tile.nx; ++i) values.at<float>(j, i) = static_cast<float>(random.normal());
  }
  filter(values, tile.spacing,
         [&](const Eigen::Vector2d& wave) { return wave.isZero() ? 0.0 : std::sqrt(std::max(0.0, power(wave))); });
  double sum = 0.0;
  for (int j = 0; j < tile.ny; ++j) {
    for (int i = 0; i < tile.nx; ++i) sum += std::pow(static_cast<double>(values.at<float>(j, i)), 2);
  }
  const double rms = std::sqrt(sum / static_cast<double>(values.total()));
  TS_ASSERT(rms > 0.0);
  values /= rms;
  return {values.begin<float>(), values.end<float>()};
}

std::vector<float> smooth_field(const ReliefTile& tile, const Eigen::Vector2d& lengths, RandomStream& random) {
  return random_field(
      tile, [&](const Eigen::Vector2d& wave) { return std::exp(-(kPi * wave.cwiseProduct(lengths)).squaredNorm()); },
      random);
}

void roughen(ReliefTile& tile, double amplitude, double length, RandomStream& random) {
  if (amplitude == 0.0) return;
  const std::vector<float> field = smooth_field(tile, {length, length}, random);
  for (std::size_t k = 0; k < field.size(); ++k) tile.heights[k] += static_cast<float>(amplitude * field[k]);
}

std::vector<float> blurred(const ReliefTile& tile, double deviation) {
  cv::Mat values = cv::Mat(tile.heights, true).reshape(1, tile.ny);
  filter(values, tile.spacing,
         [&](const Eigen::Vector2d& wave) { return std::exp(-2.0 * (kPi * deviation * wave).squaredNorm()); });
  return {values.begin<float>(), values.end<float>()};
}

std::function<double(double)> random_wave(double period, double length, RandomStream& random) {
  TS_ASSERT(length > 0.0 && length < period);
  // A few whole numbers of waves a period, the shortest wave about twice `length`.
  constexpr int kMostWaves = 8;
  const int highest = std::max(1, static_cast<int>(0.5 * period / length));
  const int count = std::min(highest, kMostWaves);
  struct Part {
    double wave, phase;
  };
  std::array<Part, kMostWaves> parts{};
  for (int k = 0; k < count; ++k) {
    const int number = highest <= kMostWaves ? k + 1 : 1 + static_cast<int>(random.uniform() * highest);
    parts[k] = {2.0 * kPi * number / period, 2.0 * kPi * random.uniform()};
  }
  return [parts, count](double place) {
    double sum = 0.0;
    for (int k = 0; k < count; ++k) sum += std::cos(parts[k].wave * place + parts[k].phase);
    return sum * std::sqrt(2.0 / count);
  };
}

}  // namespace touchstone::sim
