#include "render/imager/imager.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core.hpp>
#include <string_view>
#include <vector>

#include "core/error.h"
#include "core/random.h"
#include "render/sampling/noise_quantile.h"

namespace touchstone::render {
namespace {

constexpr double kPlanck_Js = 6.62607015e-34;
constexpr double kLightSpeed_m_per_s = 299792458.0;
constexpr std::array<std::string_view, 3> kChannelNames = {"red", "green", "blue"};

// Channels of the 2x2 pixels, row by row; R 0, G 1, B 2.
std::array<int, 4> channels_of(BayerPattern bayer) {
  switch (bayer) {
    case BayerPattern::none:
    case BayerPattern::binned:  // no mosaic to be seen
      return {0, 0, 0, 0};
    case BayerPattern::rggb:
      return {0, 1, 1, 2};
    case BayerPattern::bggr:
      return {2, 1, 1, 0};
    case BayerPattern::grbg:
      return {1, 0, 2, 1};
    case BayerPattern::gbrg:
      return {1, 2, 0, 1};
  }
  return {0, 0, 0, 0};
}

void require_finite(const char* name, double value, double low, bool low_included = true) {
  const bool holds = std::isfinite(value) && (low_included ? value >= low : value > low);
  if (!holds) {
    fail("imager: {} is {}; allowed is a finite number {} {}", name, value, low_included ? "from" : "above", low);
  }
}

void check_control(const char* name, double time_constant_s, double lowest, double highest) {
  if (!(time_constant_s > 0.0) || !std::isfinite(time_constant_s)) {
    fail("imager: {}.time_constant_s is {}; allowed is a finite number above 0", name, time_constant_s);
  }
  if (!(lowest > 0.0 && lowest < highest) || !std::isfinite(highest)) {
    fail("imager: {} keeps its factor from {} to {}; both must be above 0, the second larger", name, lowest, highest);
  }
}

double largest_number(const Imager& imager) {
  return static_cast<double>((1 << imager.bits) - 1);
}

int samples_per_pixel(const Imager& imager) {
  return CV_MAT_CN(raw_type(imager));
}

std::vector<Imager> by_channel(const Imager& imager) {
  std::vector<Imager> channels;
  for (int channel = 0; channel < imager.quantum_efficiency.rows(); ++channel) {
    channels.push_back(channel_imager(imager, channel));
  }
  return channels;
}

/// As FixedPattern::hot_e_per_s. A stream of their own keeps the rest of the pattern as it is without them.
cv::Mat hot_pixels(const HotPixels& hot, cv::Size size, int count, std::uint64_t unit_seed) {
  if (hot.share == 0.0) return {};
  cv::Mat current(size, CV_32FC(count), cv::Scalar::all(0.0));
  tbb::parallel_for(tbb::blocked_range<int>(0, size.height, 16), [&](const tbb::blocked_range<int>& rows) {
    for (int row = rows.begin(); row != rows.end(); ++row) {
      float* out = current.ptr<float>(row);
      for (int column = 0; column < size.width; ++column) {
        const std::uint64_t pixel = (static_cast<std::uint64_t>(row) << 32) | static_cast<std::uint64_t>(column);
        RandomStream stream(unit_seed, pixel, Purpose::kHotPixels);
        for (int i = 0; i < count; ++i, ++out) {
          const bool is_hot = stream.uniform() < hot.share;
          const double spread = std::exp(hot.spread * normal_quantile(stream.uniform()));
          if (is_hot) *out = static_cast<float>(hot.dark_current_e_per_s * spread);
        }
      }
    }
  });
  return current;
}

}  // namespace

void check(const Imager& imager) {
  if (imager.bits < 1 || imager.bits > 16) fail("imager: bits is {}; allowed is from 1 to 16", imager.bits);
  require_finite("active_area_um2", imager.active_area_um2, 0.0, false);
  require_finite("exposure_s", imager.exposure_s, 0.0);
  require_finite("full_well_e", imager.full_well_e, 0.0, false);
  require_finite("read_noise_e", imager.read_noise_e, 0.0);
  require_finite("dark_current_e_per_s", imager.dark_current_e_per_s, 0.0);
  require_finite("prnu", imager.prnu, 0.0);
  require_finite("dsnu_e", imager.dsnu_e, 0.0);
  require_finite("gain_DN_per_e", imager.gain_DN_per_e, 0.0, false);
  require_finite("black_level_DN", imager.black_level_DN, 0.0);
  if (imager.full_well_e > 1e9) fail("imager: full_well_e is {}; allowed is up to 1e9", imager.full_well_e);
  if (imager.black_level_DN >= largest_number(imager)) {
    fail("imager: black_level_DN is {}; allowed is below the largest number, {}", imager.black_level_DN,
         largest_number(imager));
  }
  const auto bands = imager.wavelengths_nm.size();
  const auto channels = imager.quantum_efficiency.rows();
  if (bands < 1 || imager.quantum_efficiency.cols() != bands) {
    fail("imager: quantum_efficiency has {} bands, wavelengths_nm has {}; they must be equal and at least 1",
         imager.quantum_efficiency.cols(), bands);
  }
  const bool grey = imager.bayer == BayerPattern::none;
  if (channels != (grey ? 1 : 3)) {
    fail("imager: quantum_efficiency has {} channels; a {} sensor has {}", channels, grey ? "grey" : "colour",
         grey ? 1 : 3);
  }
  for (Eigen::Index band = 0; band < bands; ++band) {
    require_finite("a wavelength (nm)", imager.wavelengths_nm[band], 0.0, false);
    for (Eigen::Index channel = 0; channel < channels; ++channel) {
      const double efficiency = imager.quantum_efficiency(channel, band);
      if (!(efficiency >= 0.0 && efficiency <= 1.0)) {
        fail("imager: a quantum efficiency (channel {}, band {}) is {}; allowed is from 0 to 1", channel, band,
             efficiency);
      }
    }
  }
  for (const double gain : imager.white_balance) require_finite("a white balance gain", gain, 0.0);
  if (grey && imager.white_balance != Eigen::Vector3d::Ones()) {
    fail("imager: a grey sensor has no white balance; allowed is (1, 1, 1)");
  }
  if (grey && imager.auto_white_balance) fail("imager: a grey sensor has no auto_white_balance");
  const HotPixels& hot = imager.hot_pixels;
  if (!(hot.share >= 0.0 && hot.share <= 1.0)) {
    fail("imager: hot_pixels.share is {}; allowed is from 0 to 1", hot.share);
  }
  require_finite("hot_pixels.dark_current_e_per_s", hot.dark_current_e_per_s, 0.0);
  require_finite("hot_pixels.spread", hot.spread, 0.0);
  check(imager.tone_curve);
  if (imager.jpeg) check(*imager.jpeg);
  if (const auto& automatic = imager.auto_exposure) {
    check_control("auto_exposure", automatic->time_constant_s, automatic->lowest, automatic->highest);
    if (!(automatic->mean_level > 0.0 && automatic->mean_level < 1.0)) {
      fail("imager: auto_exposure.mean_level is {}; allowed is above 0 and below 1", automatic->mean_level);
    }
  }
  if (const auto& automatic = imager.auto_white_balance) {
    check_control("auto_white_balance", automatic->time_constant_s, automatic->lowest, automatic->highest);
  }
}

int raw_type(const Imager& imager) {
  return CV_MAKETYPE(imager.bits <= 8 ? CV_8U : CV_16U, imager.bayer == BayerPattern::binned ? 3 : 1);
}

Imager channel_imager(const Imager& imager, int channel) {
  TS_ASSERT(channel >= 0 && channel < imager.quantum_efficiency.rows());
  Imager grey = imager;
  grey.bayer = BayerPattern::none;
  grey.white_balance = Eigen::Vector3d::Ones();
  grey.auto_white_balance.reset();
  grey.quantum_efficiency = QuantumEfficiency(imager.quantum_efficiency.row(channel));
  if (imager.bayer != BayerPattern::binned) return grey;
  const double parts = channel == 1 ? 2.0 : 1.0;  // of the size that the imager's figures are of; four make the pixel
  grey.active_area_um2 *= parts / 4.0;
  grey.full_well_e *= parts;
  grey.dark_current_e_per_s *= parts;
  grey.read_noise_e *= std::sqrt(parts);
  grey.dsnu_e *= std::sqrt(parts);
  grey.prnu /= std::sqrt(parts);
  grey.gain_DN_per_e /= parts;
  return grey;
}

FixedPattern fixed_pattern(const Imager& imager, cv::Size size, std::uint64_t unit_seed) {
  check(imager);
  const int count = samples_per_pixel(imager);
  FixedPattern pattern = {.gain = cv::Mat(size, CV_32FC(count), cv::Scalar::all(1.0)),
                          .offset_e = cv::Mat(size, CV_32FC(count), cv::Scalar::all(0.0)),
                          .hot_e_per_s = hot_pixels(imager.hot_pixels, size, count, unit_seed)};
  if (imager.prnu == 0.0 && imager.dsnu_e == 0.0) return pattern;
  const std::vector<Imager> channels = by_channel(imager);
  tbb::parallel_for(tbb::blocked_range<int>(0, size.height, 16), [&](const tbb::blocked_range<int>& rows) {
    for (int row = rows.begin(); row != rows.end(); ++row) {
      float* gain = pattern.gain.ptr<float>(row);
      float* offset = pattern.offset_e.ptr<float>(row);
      for (int column = 0; column < size.width; ++column) {
        const std::uint64_t pixel = (static_cast<std::uint64_t>(row) << 32) | static_cast<std::uint64_t>(column);
        RandomStream stream(unit_seed, pixel, Purpose::kImagerPattern);
        for (int i = 0; i < count; ++i) {
          const double relative = channels[i].prnu * normal_quantile(stream.uniform());
          *gain++ = static_cast<float>(std::max(0.0, 1.0 + relative));
          *offset++ = static_cast<float>(channels[i].dsnu_e * normal_quantile(stream.uniform()));
        }
      }
    }
  });
  return pattern;
}

ImagerResponse response_of(const Imager& imager) {
  check(imager);
  const Imager noisiest = imager.bayer == BayerPattern::binned ? channel_imager(imager, 1) : imager;
  ImagerResponse response = {.electrons_per_irradiance = imager.quantum_efficiency,
                             .dark_e = noisiest.dark_current_e_per_s * imager.exposure_s,
                             .read_noise_e = noisiest.read_noise_e,
                             .quantisation_e = 1.0 / noisiest.gain_DN_per_e,
                             .full_well_e = noisiest.full_well_e};
  for (Eigen::Index band = 0; band < imager.wavelengths_nm.size(); ++band) {
    const double photon_J = kPlanck_Js * kLightSpeed_m_per_s / (imager.wavelengths_nm[band] * 1e-9);
    for (Eigen::Index channel = 0; channel < imager.quantum_efficiency.rows(); ++channel) {
      const double area_um2 = channel_imager(imager, static_cast<int>(channel)).active_area_um2;
      response.electrons_per_irradiance(channel, band) *= area_um2 * 1e-12 * imager.exposure_s / photon_J;
    }
  }
  return response;
}

double noise_e(const ImagerResponse& response, double electrons) {
  return std::sqrt(electrons + response.dark_e + response.read_noise_e * response.read_noise_e +
                   response.quantisation_e * response.quantisation_e / 12.0);
}

int channel_of(BayerPattern bayer, int column, int row) {
  return channels_of(bayer)[2 * (row & 1) + (column & 1)];
}

Eigen::Vector3d grey_gains(const Imager& imager, const Spectrum& white) {
  check(imager);
  if (white.size() != imager.wavelengths_nm.size()) {
    fail("the white has {} bands, the imager has {}", white.size(), imager.wavelengths_nm.size());
  }
  if (imager.bayer == BayerPattern::none) return Eigen::Vector3d::Ones();
  // The exposure cancels; photons per irradiance are proportional to the wavelength.
  const Eigen::Vector3d seen = imager.quantum_efficiency * (white * imager.wavelengths_nm).matrix();
  for (int channel = 0; channel < 3; ++channel) {
    if (!(seen[channel] > 0.0 && std::isfinite(seen[channel]))) {
      fail("the {} channel sees {} of the white; it must see some to be balanced", kChannelNames[channel],
           seen[channel]);
    }
  }
  return seen.maxCoeff() * seen.cwiseInverse();
}

Imager imx273_skipping(int bits, double exposure_s) {
  Imager imager;
  imager.bits = bits;
  imager.active_area_um2 = 3.45 * 3.45;
  imager.exposure_s = exposure_s;
  imager.wavelengths_nm.resize(3);
  imager.wavelengths_nm << 450.0, 540.0, 610.0;
  imager.quantum_efficiency.resize(3, 3);
  imager.quantum_efficiency << 0.03, 0.06, 0.50,  // red
      0.10, 0.60, 0.12,                           // green
      0.50, 0.09, 0.02;                           // blue
  imager.full_well_e = 10500.0;
  imager.read_noise_e = 2.8;
  imager.dark_current_e_per_s = 10.0;
  imager.prnu = 0.005;
  imager.dsnu_e = 1.0;
  imager.bayer = BayerPattern::rggb;
  if (bits < 8 || bits > 16) fail("imager: an IMX273 of {} bits; allowed is from 8 to 16", bits);
  // Black level and gain depend on each other: full well + black level fill the range.
  const double largest = largest_number(imager);
  imager.black_level_DN = std::ceil(4.0 * imager.read_noise_e * largest / imager.full_well_e);
  imager.gain_DN_per_e = (largest - imager.black_level_DN) / imager.full_well_e;
  check(imager);
  return imager;
}

}  // namespace touchstone::render
