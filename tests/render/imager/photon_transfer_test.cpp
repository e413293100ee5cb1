// The photon transfer curve of every imager preset, from the dark to beyond saturation, after [EMVA1288]:
//   mean = black + K (eta photons + dark),   variance = K^2 read^2 + 1/12 + K (mean - black).

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "render/imager/imager_presets.h"

namespace touchstone::render {
namespace {

struct TransferPoint {
  double mean = 0.0;      ///< digital number
  double variance = 0.0;  ///< mean square deviation from what is expected, clipping left aside
  double offset = 0.0;    ///< mean deviation from it
};

/// A frame's numbers where a pixel gets `electrons` on average. Rounding adds exactly 1/12 to the mean square deviation
/// from the expected number, however coarse the steps are, if the expected number runs evenly over a whole step: so
/// the columns differ by one step from left to right, and the line can be tested on 6 bits, whose step is wider than
/// the noise. `even` turns that off.
TransferPoint measure(const Imager& imager, double electrons, bool even = false) {
  const ImagerResponse response = response_of(imager);
  const cv::Size size(1000, 400);
  const FixedPattern pattern = {cv::Mat(size, CV_32FC1, cv::Scalar(1.0)), cv::Mat(size, CV_32FC1, cv::Scalar(0.0))};
  cv::Mat light(size, CV_32FC3, cv::Scalar::all(0.0));
  cv::Mat expected_e(size, CV_64FC1);
  for (int row = 0; row < size.height; ++row) {
    for (int column = 0; column < size.width; ++column) {
      const double step = even ? 0.0 : ((column + 0.5) / size.width - 0.5) / imager.gain_DN_per_e;
      const int channel = imager.bayer == BayerPattern::none ? 0 : channel_of(imager.bayer, column, row);
      light.at<cv::Vec3f>(row, column)[1] =
          static_cast<float>((electrons + step) / response.electrons_per_irradiance(channel, 1));
      expected_e.at<double>(row, column) = electrons + step;
    }
  }
  const cv::Mat raw = expose(light, imager, pattern, 5, 1);
  TransferPoint point;
  for (int row = 0; row < size.height; ++row) {
    for (int column = 0; column < size.width; ++column) {
      const double number =
          raw.type() == CV_8UC1 ? raw.at<std::uint8_t>(row, column) : raw.at<std::uint16_t>(row, column);
      const double off = number - imager.black_level_DN -
                         imager.gain_DN_per_e * (expected_e.at<double>(row, column) + response.dark_e);
      point.mean += number / size.area();
      point.offset += off / size.area();
      point.variance += off * off / size.area();
    }
  }
  return point;
}

class PhotonTransfer : public testing::TestWithParam<std::string_view> {
 protected:
  const Imager imager = imager_preset(GetParam(), 1e-3).imager;
  const double gain = imager.gain_DN_per_e;
  const double dark_e = response_of(imager).dark_e;
  const double noise_of_dark = gain * gain * imager.read_noise_e * imager.read_noise_e + 1.0 / 12.0;
  static constexpr double kPixels = 400000.0;
};

/// Electrons from little light to much that are never clipped: five standard deviations and more from the full well,
/// and from where numbers below zero would be cut.
std::vector<double> unclipped(const Imager& imager) {
  const double step = 1.0 / imager.gain_DN_per_e;
  const double least =
      std::max(0.5 * step, 30.0 + 6.0 * imager.read_noise_e + 2.0 * step - imager.black_level_DN * step);
  const double most = imager.full_well_e - 5.0 * std::sqrt(imager.full_well_e) - 5.0 * imager.read_noise_e - step;
  std::vector<double> electrons;
  constexpr int kPoints = 8;
  for (int i = 0; i < kPoints; ++i) electrons.push_back(least * std::pow(most / least, i / (kPoints - 1.0)));
  return electrons;
}

TEST_P(PhotonTransfer, VarianceLiesOnItsLine) {
  double sum_x = 0.0, sum_y = 0.0, sum_xx = 0.0, sum_xy = 0.0, weights = 0.0;
  for (const double electrons : unclipped(imager)) {
    const TransferPoint point = measure(imager, electrons);
    const double x = point.mean - imager.black_level_DN;
    const double line = noise_of_dark + gain * x;
    // A variance of n samples has a standard error of sqrt(2/n) of it, 0.22 %, and more where few electrons make it.
    EXPECT_NEAR(point.variance / line, 1.0, 0.012) << electrons << " electrons";
    const double weight = 1.0 / (line * line);
    sum_x += weight * x;
    sum_y += weight * point.variance;
    sum_xx += weight * x * x;
    sum_xy += weight * x * point.variance;
    weights += weight;
  }
  // The line's slope is the gain, its start the noise in the dark: what a user measures on an unknown camera.
  const double slope = (weights * sum_xy - sum_x * sum_y) / (weights * sum_xx - sum_x * sum_x);
  const double start = (sum_y - slope * sum_x) / weights;
  EXPECT_NEAR(slope / gain, 1.0, 0.01);
  EXPECT_NEAR(start, noise_of_dark, 0.02 * noise_of_dark + 0.02 * gain * unclipped(imager).front() * gain);
}

TEST_P(PhotonTransfer, MeanIsLinear) {
  for (const double electrons : unclipped(imager)) {
    const TransferPoint point = measure(imager, electrons);
    const double error = std::sqrt(point.variance / kPixels);
    EXPECT_NEAR(point.offset, 0.0, 4.5 * error + 1e-5 * gain * electrons) << electrons << " electrons";
  }
}

TEST_P(PhotonTransfer, DarkIsTheBlackLevel) {
  const TransferPoint dark = measure(imager, 0.0, true);
  // Numbers below zero are cut, and a step wider than the noise shows one number only.
  const double spread = std::sqrt(noise_of_dark + gain * gain * dark_e);
  EXPECT_NEAR(dark.mean, imager.black_level_DN + gain * dark_e, 0.5 + 0.5 * spread);
  EXPECT_LE(dark.variance, 1.02 * (0.25 + spread * spread));
}

// Beyond the full well all pixels show the largest number: the variance has fallen to nothing, as real curves do.
TEST_P(PhotonTransfer, SaturatesAtTheFullWell) {
  const double largest = (1 << imager.bits) - 1;
  const TransferPoint below = measure(imager, 0.9 * imager.full_well_e, true);
  EXPECT_LT(below.mean, 0.93 * largest);
  const TransferPoint above = measure(imager, 1.5 * imager.full_well_e, true);
  const double read_DN = gain * imager.read_noise_e;
  EXPECT_LE(above.mean, largest + 1e-6);
  EXPECT_GT(above.mean, largest - read_DN - 0.5);
  const cv::Mat dazzled = expose(cv::Mat(200, 200, CV_32FC3, cv::Scalar::all(1e9)), imager, 1, 1);
  cv::Scalar mean, deviation;
  cv::meanStdDev(dazzled, mean, deviation);
  EXPECT_LT(deviation[0] * deviation[0], 0.5 * noise_of_dark + gain * gain * imager.dsnu_e * imager.dsnu_e + 0.01)
      << "only read noise that lowers the number is left";
}

// The best signal to noise ratio is that of the photons in a full well, sqrt(full well), but for the imager's own
// noise.
TEST_P(PhotonTransfer, BestSignalToNoiseIsThatOfAFullWell) {
  const double electrons = unclipped(imager).back();
  const TransferPoint point = measure(imager, electrons);
  const double ratio = (point.mean - imager.black_level_DN - gain * dark_e) / std::sqrt(point.variance);
  const double photons_only = std::sqrt(electrons);
  const double own = (imager.read_noise_e * imager.read_noise_e + dark_e + 1.0 / (12.0 * gain * gain)) / electrons;
  EXPECT_NEAR(ratio, photons_only / std::sqrt(1.0 + own), 0.01 * photons_only);
  EXPECT_LT(ratio, 1.01 * std::sqrt(imager.full_well_e));
}

INSTANTIATE_TEST_SUITE_P(AllPresets, PhotonTransfer, testing::ValuesIn(imager_preset_names()),
                         [](const testing::TestParamInfo<std::string_view>& one) {
                           std::string name(one.param);
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

}  // namespace
}  // namespace touchstone::render
