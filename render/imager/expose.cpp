// A row at a time, in loops without branches over its pixels; what needs a call (tails of the normal distribution, few
// photons) is put in afterwards, pixel by pixel.

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cfloat>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <vector>

#include "core/error.h"
#include "core/uniform_pairs.h"
#include "core/wide_clones.h"
#include "render/imager/imager.h"
#include "render/sampling/noise_quantile.h"

namespace touchstone::render {
namespace {

constexpr int kLongestSide = 1 << 16;  // a pixel's row and column share 32 bits of its random stream's index

/// How one number comes of a pixel's electrons: that of a channel.
struct Sample {
  double exposure_s, dark_e, full_well_e, read_noise_e, gain, black, largest;

  explicit Sample(const Imager& grey)
      : exposure_s(grey.exposure_s),
        dark_e(grey.dark_current_e_per_s * grey.exposure_s),
        full_well_e(grey.full_well_e),
        read_noise_e(grey.read_noise_e),
        gain(grey.gain_DN_per_e),
        black(grey.black_level_DN),
        largest(static_cast<double>((1 << grey.bits) - 1)) {}

  /// Far above the well every draw saturates; beyond it no counts are drawn, so that they stay exact.
  double most_counted_e() const { return 4.0 * full_well_e + 1e4; }
};

/// One channel of a row.
struct Row {
  std::vector<double> mean_e, electrons;  // with the dark current; counted
  std::vector<double> share, read_share;  // uniform numbers: of photons and of the read noise
  std::vector<double> normal;             // of either

  explicit Row(int width) : mean_e(width), electrons(width), share(width), read_share(width), normal(width) {}
  int width() const { return static_cast<int>(mean_e.size()); }
};

/// Electrons of one band, by the columns' parity.
TS_WIDE_CLONES void add_light(const float* light, int stride, const std::array<double, 2>& weight, int width,
                              double* mean_e) {
  for (int k = 0; k + 1 < width; k += 2) {
    mean_e[k] += weight[0] * static_cast<double>(light[k * stride]);
    mean_e[k + 1] += weight[1] * static_cast<double>(light[(k + 1) * stride]);
  }
  if (width % 2 != 0) mean_e[width - 1] += weight[0] * static_cast<double>(light[(width - 1) * stride]);
}

/// Of a row's channel; every `stride`-th number.
struct RowPattern {
  const float *gain, *offset_e, *hot_e_per_s;  // the last may be null
  int stride;
};

TS_WIDE_CLONES void scale_by_pattern(const Sample& sample, const RowPattern& pattern, int width, double* mean_e) {
  for (int k = 0; k < width; ++k) {
    mean_e[k] = mean_e[k] * static_cast<double>(pattern.gain[k * pattern.stride]) + sample.dark_e;
  }
  if (pattern.hot_e_per_s == nullptr) return;
  for (int k = 0; k < width; ++k) {
    mean_e[k] += static_cast<double>(pattern.hot_e_per_s[k * pattern.stride]) * sample.exposure_s;
  }
}

TS_WIDE_CLONES void central_normals(const double* shares, int width, double* normals) {
  for (int k = 0; k < width; ++k) normals[k] = central_normal_quantile(shares[k] - 0.5);
}

void find_normals(const double* shares, int width, double* normals) {
  central_normals(shares, width, normals);
  for (int k = 0; k < width; ++k) {
    if (std::abs(shares[k] - 0.5) > kCentralNormal) normals[k] = normal_quantile(shares[k]);
  }
}

TS_WIDE_CLONES void count_many(const double* mean_e, const double* normals, int width, double* electrons) {
  for (int k = 0; k < width; ++k) electrons[k] = std::floor(std::max(0.0, many_counts(mean_e[k], normals[k])));
}

void count(const Sample& sample, Row& row) {
  find_normals(row.share.data(), row.width(), row.normal.data());
  count_many(row.mean_e.data(), row.normal.data(), row.width(), row.electrons.data());
  const double most = sample.most_counted_e();
  for (int k = 0; k < row.width(); ++k) {
    const double mean = row.mean_e[k];
    if (mean >= kFewCounts && mean <= most) continue;
    row.electrons[k] = mean > most ? sample.full_well_e : poisson_quantile(mean, row.share[k]);
  }
}

TS_WIDE_CLONES void add_read_noise(const Sample& sample, const RowPattern& pattern, const double* normals, int width,
                                   double* electrons) {
  for (int k = 0; k < width; ++k) {
    electrons[k] = std::min(electrons[k], sample.full_well_e) +
                   (static_cast<double>(pattern.offset_e[k * pattern.stride]) + sample.read_noise_e * normals[k]);
  }
}

/// Rounding: truncation rounds down because the number is positive by then.
template <typename Number>
void to_numbers(const Sample& sample, const Row& row, int stride, Number* out) {
  for (int k = 0; k < row.width(); ++k) {
    const double number = sample.black + sample.gain * row.electrons[k];
    out[k * stride] = static_cast<Number>(static_cast<int>(std::clamp(number, 0.0, sample.largest) + 0.5));
  }
}

[[noreturn]] void refuse_irradiance(const cv::Mat& irradiance, int row) {
  const int bands = irradiance.channels();
  const float* values = irradiance.ptr<float>(row);
  for (int i = 0; i < irradiance.cols * bands; ++i) {
    if (!(values[i] >= 0.0F && values[i] <= FLT_MAX)) {
      fail("irradiance of pixel (column {}, row {}), band {} is {}; allowed is a finite number from 0", i / bands, row,
           i % bands, values[i]);
    }
  }
  TS_ASSERT(false && "the row holds a bad irradiance");
  std::abort();
}

template <typename Number>
cv::Mat expose_as(const cv::Mat& irradiance, const Imager& imager, const FixedPattern& pattern, std::uint64_t seed,
                  std::uint64_t frame_index) {
  const QuantumEfficiency weights = response_of(imager).electrons_per_irradiance;
  std::vector<Sample> samples;
  for (int channel = 0; channel < weights.rows(); ++channel) samples.emplace_back(channel_imager(imager, channel));
  const int bands = irradiance.channels();
  const int width = irradiance.cols;
  cv::Mat raw(irradiance.size(), raw_type(imager));
  const int count_of = raw.channels();
  std::atomic<int> first_bad_row = std::numeric_limits<int>::max();

  const auto expose_row = [&](int number, Row& row) {
    const float* light = irradiance.ptr<float>(number);
    const bool good = std::all_of(light, light + static_cast<std::ptrdiff_t>(width) * bands,
                                  [](float value) { return value >= 0.0F && value <= FLT_MAX; });
    if (!good) {
      int known = first_bad_row.load();
      while (number < known && !first_bad_row.compare_exchange_weak(known, number)) {
      }
      return;
    }
    const std::uint64_t first_index = (frame_index << 32) | (static_cast<std::uint64_t>(number) << 16);
    for (int i = 0; i < count_of; ++i) {
      // Channels of a mosaic differ in what light does alone.
      const Sample& sample = samples[i];
      const int channels[2] = {count_of > 1 ? i : channel_of(imager.bayer, 0, number),
                               count_of > 1 ? i : channel_of(imager.bayer, 1, number)};
      std::ranges::fill(row.mean_e, 0.0);
      for (int band = 0; band < bands; ++band) {
        add_light(light + band, bands, {weights(channels[0], band), weights(channels[1], band)}, width,
                  row.mean_e.data());
      }
      if (imager.ideal) {
        for (int k = 0; k < width; ++k) row.electrons[k] = std::min(row.mean_e[k], sample.full_well_e);
      } else {
        const RowPattern here = {pattern.gain.ptr<float>(number) + i, pattern.offset_e.ptr<float>(number) + i,
                                 pattern.hot_e_per_s.empty() ? nullptr : pattern.hot_e_per_s.ptr<float>(number) + i,
                                 count_of};
        // Two draws a number, whatever the light, so that it doesn't change what the pixel's next one draws.
        uniform_pairs(seed, first_index, Purpose::kImagerNoise, static_cast<std::uint32_t>(i), row.share,
                      row.read_share);
        scale_by_pattern(sample, here, width, row.mean_e.data());
        count(sample, row);
        find_normals(row.read_share.data(), width, row.normal.data());
        add_read_noise(sample, here, row.normal.data(), width, row.electrons.data());
      }
      to_numbers(sample, row, count_of, raw.ptr<Number>(number) + i);
    }
  };
  tbb::parallel_for(tbb::blocked_range<int>(0, irradiance.rows, 16), [&](const tbb::blocked_range<int>& rows) {
    Row row(width);
    for (int number = rows.begin(); number != rows.end(); ++number) expose_row(number, row);
  });
  if (first_bad_row.load() < irradiance.rows) refuse_irradiance(irradiance, first_bad_row.load());
  return raw;
}

}  // namespace

cv::Mat expose(const cv::Mat& irradiance, const Imager& imager, const FixedPattern& pattern, std::uint64_t seed,
               std::uint64_t frame_index) {
  check(imager);
  TS_ASSERT(frame_index <= 0xffffffffu);
  if (irradiance.empty() || irradiance.depth() != CV_32F || irradiance.dims != 2) {
    fail("irradiance must be a picture of 32 bit floats that isn't empty");
  }
  if (irradiance.cols > kLongestSide || irradiance.rows > kLongestSide) {
    fail("irradiance has {}x{} pixels; allowed is up to {} each", irradiance.cols, irradiance.rows, kLongestSide);
  }
  if (irradiance.channels() != imager.wavelengths_nm.size()) {
    fail("irradiance has {} bands, the imager has {}", irradiance.channels(), imager.wavelengths_nm.size());
  }
  if (!imager.ideal) {
    const int type = CV_32FC(CV_MAT_CN(raw_type(imager)));
    const bool fits = pattern.gain.size() == irradiance.size() && pattern.offset_e.size() == irradiance.size() &&
                      pattern.gain.type() == type && pattern.offset_e.type() == type &&
                      (pattern.hot_e_per_s.empty() ||
                       (pattern.hot_e_per_s.size() == irradiance.size() && pattern.hot_e_per_s.type() == type));
    if (!fits) {
      fail("the fixed pattern isn't of the irradiance's size, {}x{}, and the imager's {} channels", irradiance.cols,
           irradiance.rows, CV_MAT_CN(raw_type(imager)));
    }
  }
  return imager.bits <= 8 ? expose_as<std::uint8_t>(irradiance, imager, pattern, seed, frame_index)
                          : expose_as<std::uint16_t>(irradiance, imager, pattern, seed, frame_index);
}

cv::Mat expose(const cv::Mat& irradiance, const Imager& imager, std::uint64_t seed, std::uint64_t frame_index) {
  const FixedPattern pattern = imager.ideal ? FixedPattern{} : fixed_pattern(imager, irradiance.size(), seed);
  return expose(irradiance, imager, pattern, seed, frame_index);
}

}  // namespace touchstone::render
