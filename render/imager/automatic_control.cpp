#include "render/imager/automatic_control.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include "core/error.h"

namespace touchstone::render {
namespace {

// 32 bins an octave: a float's exponent and the first five bits of its mantissa. Darker levels are in the first,
// brighter ones in the last. Only the bin in which the clipping level lies is read as if all of it had its mean.
constexpr float kLowest = 0x1p-12F;
constexpr int kMantissaBits = 23 - 5;

int bin_of(float level) {
  const auto first = static_cast<int>(std::bit_cast<std::uint32_t>(kLowest) >> kMantissaBits);
  const auto place = static_cast<int>(std::bit_cast<std::uint32_t>(level) >> kMantissaBits);
  return std::clamp(place - first, 0, Metering::kBins - 1);
}

/// The exposure that the meter asks for, if it reads this at `factor`.
double wanted_exposure(const AutoExposure& automatic, const Metering& metering, double factor) {
  const double mean = metering.mean(factor);
  const double wanted = mean > 0.0 ? factor * automatic.mean_level / mean : automatic.highest;
  return std::clamp(wanted, automatic.lowest, automatic.highest);
}

/// The gains that make the mean of the picture grey: [Buchsbaum1980]. Green's stays.
Eigen::Vector3d wanted_gains(const Imager& imager, const Metering& metering, double factor) {
  const AutoWhiteBalance& automatic = *imager.auto_white_balance;
  const double green = imager.white_balance[1] * metering.mean(1, factor);
  Eigen::Vector3d gains(1.0, 1.0, 1.0);
  for (const int channel : {0, 2}) {
    const double own = imager.white_balance[channel] * metering.mean(channel, factor);
    if (own > 0.0) gains[channel] = std::clamp(green / own, automatic.lowest, automatic.highest);
  }
  return gains;
}

/// From a to b by a part of the way, in logarithms.
double nearer(double a, double b, double part) {
  return a * std::pow(b / a, part);
}

}  // namespace

double Metering::mean(int channel, double factor) const {
  double sum = 0.0;
  double count = 0.0;
  for (const Bin& bin : bins[static_cast<std::size_t>(channel)]) {
    sum += bin.count * std::min(factor * bin.level, full);
    count += bin.count;
  }
  return count > 0.0 ? sum / count : 0.0;
}

double Metering::mean(double factor) const {
  if (channels == 1) return mean(0, factor);
  return 0.25 * (mean(0, factor) + 2.0 * mean(1, factor) + mean(2, factor));
}

Metering metering_of(const cv::Mat& irradiance, const Imager& imager) {
  TS_ASSERT(irradiance.depth() == CV_32F && irradiance.channels() == imager.wavelengths_nm.size());
  const QuantumEfficiency per_light = response_of(imager).electrons_per_irradiance;
  const double range = (1 << imager.bits) - 1 - imager.black_level_DN;
  Metering metering;
  metering.channels = static_cast<int>(per_light.rows());
  metering.full = std::min(1.0, imager.gain_DN_per_e * imager.full_well_e / range);
  const int bands = irradiance.channels();
  for (int c = 0; c < metering.channels; ++c) {
    const Imager channel = channel_imager(imager, c);
    const double per_e = channel.gain_DN_per_e / range;
    const double dark = per_e * channel.dark_current_e_per_s * channel.exposure_s;
    std::array<double, 16> weights{};
    for (int b = 0; b < bands; ++b) weights[static_cast<std::size_t>(b)] = per_e * per_light(c, b);
    auto& bins = metering.bins[static_cast<std::size_t>(c)];
    for (int row = 0; row < irradiance.rows; ++row) {
      const float* light = irradiance.ptr<float>(row);
      for (int column = 0; column < irradiance.cols; ++column, light += bands) {
        double level = dark;
        for (int b = 0; b < bands; ++b) level += weights[static_cast<std::size_t>(b)] * static_cast<double>(light[b]);
        Metering::Bin& bin = bins[static_cast<std::size_t>(bin_of(static_cast<float>(level)))];
        bin.count += 1.0;
        bin.level += level;
      }
    }
    for (Metering::Bin& bin : bins) bin.level /= std::max(1.0, bin.count);
  }
  return metering;
}

ControlState settled(const Imager& imager, const Metering& metering) {
  ControlState state;
  if (imager.auto_exposure) {
    // What clips reads too little, so each step of a too bright picture may be too small: it is repeated.
    constexpr int kMostSteps = 200;
    for (int step = 0; step < kMostSteps; ++step) {
      const double wanted = wanted_exposure(*imager.auto_exposure, metering, state.exposure);
      const bool there = std::abs(wanted - state.exposure) <= 1e-12 * state.exposure;
      state.exposure = wanted;
      if (there) break;
    }
  }
  if (imager.auto_white_balance) state.gains = wanted_gains(imager, metering, state.exposure);
  return state;
}

ControlState next_state(const Imager& imager, const ControlState& state, const Metering& metering, double seconds) {
  TS_ASSERT(seconds >= 0.0);
  ControlState next = state;
  if (imager.auto_exposure) {
    const double part = -std::expm1(-seconds / imager.auto_exposure->time_constant_s);
    next.exposure = nearer(state.exposure, wanted_exposure(*imager.auto_exposure, metering, state.exposure), part);
  }
  if (imager.auto_white_balance) {
    const double part = -std::expm1(-seconds / imager.auto_white_balance->time_constant_s);
    const Eigen::Vector3d wanted = wanted_gains(imager, metering, state.exposure);
    for (int channel = 0; channel < 3; ++channel) {
      next.gains[channel] = nearer(state.gains[channel], wanted[channel], part);
    }
  }
  return next;
}

Imager controlled(const Imager& imager, const ControlState& state) {
  Imager set = imager;
  set.exposure_s *= state.exposure;
  set.white_balance = imager.white_balance.cwiseProduct(state.gains);
  return set;
}

}  // namespace touchstone::render
