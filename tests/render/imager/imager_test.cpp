#include "render/imager/imager.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <utility>
#include <vector>

#include "core/error.h"
#include "render/sampling/noise_quantile.h"
#include "tests/render/imager/imager_laws.h"

namespace touchstone::render {
namespace {

constexpr double kPlanckTimesLight = 6.62607015e-34 * 299792458.0;

// A grey sensor of one band whose numbers are round.
Imager grey_imager() {
  Imager imager;
  imager.bits = 12;
  imager.active_area_um2 = 10.0;
  imager.exposure_s = 1e-3;
  imager.quantum_efficiency.resize(1, 1);
  imager.quantum_efficiency << 0.5;
  imager.wavelengths_nm.resize(1);
  imager.wavelengths_nm << 540.0;
  imager.full_well_e = 10000.0;
  imager.read_noise_e = 3.0;
  imager.gain_DN_per_e = 0.35;
  imager.black_level_DN = 20.0;
  return imager;
}

// Three bands, each seen by one channel only.
Imager colour_imager(BayerPattern bayer) {
  Imager imager = grey_imager();
  imager.bits = 8;
  imager.gain_DN_per_e = 255.0 / 10000.0;
  imager.black_level_DN = 0.0;
  imager.wavelengths_nm.resize(3);
  imager.wavelengths_nm << 600.0, 550.0, 450.0;
  imager.quantum_efficiency = Eigen::Matrix3d::Identity() * 0.5;
  imager.bayer = bayer;
  return imager;
}

double irradiance_for(const Imager& imager, double electrons, int channel = 0) {
  return electrons / response_of(imager).electrons_per_irradiance(channel, channel);
}

cv::Mat flat(int width, int height, double irradiance) {
  return cv::Mat(height, width, CV_32FC1, cv::Scalar(irradiance));
}

double mean_of(const cv::Mat& image) {
  return cv::mean(image)[0];
}

// Half the variance of the difference: what changes from frame to frame, without the fixed pattern.
double temporal_variance(const cv::Mat& a, const cv::Mat& b) {
  cv::Mat x;
  cv::Mat y;
  a.convertTo(x, CV_64F);
  b.convertTo(y, CV_64F);
  cv::Scalar mean;
  cv::Scalar deviation;
  cv::meanStdDev(x - y, mean, deviation);
  return deviation[0] * deviation[0] / 2.0;
}

TEST(NoiseQuantile, NormalQuantileInvertsTheErrorFunction) {
  for (double u = 1e-9; u < 0.5; u *= 1.07) {
    for (const double share : {u, 1.0 - u}) {
      const double x = normal_quantile(share);
      const double tail = 0.5 * std::erfc(std::abs(x) / std::sqrt(2.0));
      EXPECT_NEAR(tail / std::min(share, 1.0 - share), 1.0, 1e-5) << share;
      EXPECT_EQ(x < 0.0, share < 0.5);
    }
  }
  EXPECT_EQ(normal_quantile(0.5), 0.0);
  EXPECT_TRUE(std::isfinite(normal_quantile(0.0)));
  EXPECT_TRUE(std::isfinite(normal_quantile(1.0)));
}

TEST(NoiseQuantile, PoissonQuantileInvertsTheDistribution) {
  for (const double mean : {0.0, 0.01, 0.7, 5.0, 31.9, 32.0, 50.0, 300.0, 9000.0}) {
    std::vector<double> share;  // of numbers up to k
    double sum = 0.0;
    const auto last = static_cast<int>(mean + 12.0 * std::sqrt(mean) + 30.0);
    for (int k = 0; k <= last; ++k) {
      sum += mean == 0.0 ? (k == 0 ? 1.0 : 0.0) : std::exp(k * std::log(mean) - mean - std::lgamma(k + 1.0));
      share.push_back(sum);
    }
    int wrong = 0;
    constexpr int kSteps = 20000;
    for (int i = 0; i < kSteps; ++i) {
      const double u = (i + 0.5) / kSteps;
      const double expected = static_cast<double>(std::upper_bound(share.begin(), share.end(), u) - share.begin());
      const double got = poisson_quantile(mean, u);
      if (got != expected) ++wrong;
      ASSERT_LE(std::abs(got - expected), 1.0) << "mean " << mean << ", u " << u;
    }
    EXPECT_LE(wrong, mean < 32.0 ? 0 : kSteps / 1000) << "mean " << mean;
  }
}

TEST(Imager, PhotonTransferIsALine) {
  Imager imager = grey_imager();
  imager.dark_current_e_per_s = 5000.0;  // 5 electrons an exposure
  imager.prnu = 0.01;
  imager.dsnu_e = 2.0;
  const double gain = imager.gain_DN_per_e;
  const double dark_variance = imager.read_noise_e * imager.read_noise_e + 5.0;
  const cv::Size size(400, 400);
  const FixedPattern pattern = fixed_pattern(imager, size, 7);
  const double mean_dark = mean_of(expose(flat(size.width, size.height, 0.0), imager, pattern, 7, 0));
  EXPECT_NEAR(mean_dark, imager.black_level_DN + gain * 5.0, 0.01);
  for (const double electrons : {0.0, 10.0, 29.0, 40.0, 300.0, 1000.0, 4000.0, 8500.0}) {
    const cv::Mat light = flat(size.width, size.height, irradiance_for(imager, electrons));
    const cv::Mat a = expose(light, imager, pattern, 7, 1);
    const cv::Mat b = expose(light, imager, pattern, 7, 2);
    const double expected = gain * gain * dark_variance + 1.0 / 12.0 + gain * (mean_of(a) - mean_dark);
    // The standard error of a variance of n samples is sqrt(2/n) of it: 0.35 % here.
    EXPECT_NEAR(temporal_variance(a, b) / expected, 1.0, 0.015) << electrons << " electrons";
  }
}

TEST(Imager, MeanEqualsTheExpectation) {
  Imager imager = grey_imager();
  for (const double electrons : {3.0, 50.0, 2000.0}) {
    const double irradiance = irradiance_for(imager, electrons);
    // By hand: E A t lambda / (h c) eta.
    EXPECT_NEAR(irradiance * 10e-12 * 1e-3 * 540e-9 / kPlanckTimesLight * 0.5, electrons, 1e-9 * electrons);
    const cv::Mat raw = expose(flat(300, 300, irradiance), imager, 3, 4);
    const double expected = 20.0 + 0.35 * electrons;
    const double standard_error = 0.35 * noise_e(response_of(imager), electrons) / 300.0;
    EXPECT_NEAR(mean_of(raw), expected, 4.0 * standard_error + 1e-6 * expected) << electrons;
  }
}

TEST(Imager, BandsAddUp) {
  Imager imager = grey_imager();
  imager.quantum_efficiency.resize(1, 3);
  imager.quantum_efficiency << 0.2, 0.5, 0.3;
  imager.wavelengths_nm.resize(3);
  imager.wavelengths_nm << 450.0, 540.0, 610.0;
  imager.ideal = true;
  const cv::Mat light(1, 1, CV_32FC3, cv::Scalar(0.1, 0.2, 0.3));
  const double electrons =
      10e-12 * 1e-3 / kPlanckTimesLight * 1e-9 * (0.1 * 450.0 * 0.2 + 0.2 * 540.0 * 0.5 + 0.3 * 610.0 * 0.3);
  ASSERT_LT(electrons, imager.full_well_e);
  EXPECT_NEAR(expose(light, imager, 1, 1).at<std::uint16_t>(0, 0), 20.0 + 0.35 * electrons, 0.5001);
}

TEST(Imager, FixedPatternHasTheStatedSpreadAndStaysFromFrameToFrame) {
  Imager imager = grey_imager();
  imager.prnu = 0.02;
  imager.dsnu_e = 5.0;
  const FixedPattern pattern = fixed_pattern(imager, {300, 300}, 11);
  cv::Scalar mean;
  cv::Scalar deviation;
  cv::meanStdDev(pattern.gain, mean, deviation);
  EXPECT_NEAR(mean[0], 1.0, 4.0 * 0.02 / 300.0);
  EXPECT_NEAR(deviation[0], 0.02, 0.02 * 0.01);
  cv::meanStdDev(pattern.offset_e, mean, deviation);
  EXPECT_NEAR(mean[0], 0.0, 4.0 * 5.0 / 300.0);
  EXPECT_NEAR(deviation[0], 5.0, 5.0 * 0.01);
  // A unit's pattern belongs to its pixels, not to the size of the picture.
  const FixedPattern corner = fixed_pattern(imager, {40, 30}, 11);
  EXPECT_TRUE(same_bytes(corner.gain, pattern.gain(cv::Rect(0, 0, 40, 30)).clone()));
  // Another unit has another one.
  EXPECT_FALSE(same_bytes(corner.gain, fixed_pattern(imager, {40, 30}, 12).gain));
  const cv::Mat light = flat(300, 300, irradiance_for(imager, 5000.0));
  const cv::Mat a = expose(light, imager, 11, 1);
  const cv::Mat b = expose(light, imager, 11, 2);
  cv::meanStdDev(a, mean, deviation);
  const double spread = std::pow(0.35 * 5000.0 * 0.02, 2) + std::pow(0.35 * 5.0, 2);
  EXPECT_NEAR(deviation[0] * deviation[0] - temporal_variance(a, b), spread, 0.03 * spread);
}

TEST(Imager, NoiseOfFramesAndPixelsIsIndependent) {
  const Imager imager = grey_imager();
  const cv::Mat light = flat(300, 300, irradiance_for(imager, 1000.0));
  cv::Mat a;
  cv::Mat b;
  expose(light, imager, 5, 0).convertTo(a, CV_64F);
  expose(light, imager, 5, 1).convertTo(b, CV_64F);
  a -= cv::mean(a);
  b -= cv::mean(b);
  const double power = a.dot(a);
  const double limit = 4.5 / 300.0;  // in standard errors of a correlation, 1/sqrt(n)
  EXPECT_LT(std::abs(a.dot(b)) / power, limit);
  const cv::Mat left = a(cv::Rect(0, 0, 299, 299));
  EXPECT_LT(std::abs(left.dot(a(cv::Rect(1, 0, 299, 299)))) / power, limit);
  EXPECT_LT(std::abs(left.dot(a(cv::Rect(0, 1, 299, 299)))) / power, limit);
}

TEST(Imager, SaturationClipsAtTheFullWell) {
  Imager imager = grey_imager();
  imager.read_noise_e = 0.0;
  for (const double irradiance : {irradiance_for(imager, 15000.0), irradiance_for(imager, 1e9), 1e37}) {
    const cv::Mat raw = expose(flat(8, 8, irradiance), imager, 1, 1);
    EXPECT_EQ(cv::norm(raw, cv::Mat(8, 8, CV_16UC1, cv::Scalar(20.0 + 3500.0)), cv::NORM_INF), 0.0);
  }
  imager.gain_DN_per_e = 10.0;  // the converter saturates before the well
  const cv::Mat raw = expose(flat(8, 8, irradiance_for(imager, 5000.0)), imager, 1, 1);
  EXPECT_EQ(cv::norm(raw, cv::Mat(8, 8, CV_16UC1, cv::Scalar(4095.0)), cv::NORM_INF), 0.0);
}

TEST(Imager, ZeroLightAndZeroExposureGiveTheBlackLevel) {
  Imager imager = grey_imager();
  imager.dark_current_e_per_s = 1e6;
  Imager shut = imager;
  shut.exposure_s = 0.0;
  const cv::Mat dark = expose(flat(200, 200, 123.0), shut, 1, 1);
  EXPECT_NEAR(mean_of(dark), 20.0, 4.0 * 0.35 * 3.0 / 200.0);
  imager.read_noise_e = 0.0;
  imager.dark_current_e_per_s = 0.0;
  const cv::Mat zero = expose(flat(5, 5, 0.0), imager, 1, 1);
  EXPECT_EQ(cv::norm(zero, cv::Mat(5, 5, CV_16UC1, cv::Scalar(20.0)), cv::NORM_INF), 0.0);
}

TEST(Imager, OnePixelSensorWorks) {
  const Imager grey = grey_imager();
  const cv::Mat raw = expose(flat(1, 1, irradiance_for(grey, 5000.0)), grey, 1, 1);
  EXPECT_NEAR(raw.at<std::uint16_t>(0, 0), 20.0 + 1750.0, 8.0 * 0.35 * 71.0);
  EXPECT_EQ(develop(raw, grey).size(), cv::Size(1, 1));
  const Imager colour = colour_imager(BayerPattern::rggb);
  const cv::Mat one(1, 1, CV_32FC3, cv::Scalar(0.1, 0.1, 0.1));
  EXPECT_EQ(expose(one, colour, 1, 1).size(), cv::Size(1, 1));
  EXPECT_THROW(develop(expose(one, colour, 1, 1), colour), Error);
}

TEST(Imager, SameBytesWithAnyNumberOfThreads) {
  expect_same_bytes_on_any_threads(imx273_skipping(8, 1e-3), 0.01F, 0.3F);
}

TEST(Imager, APixelsNoiseDependsOnItsOwnLightOnlyAndGrowsWithIt) {
  const Imager imager = grey_imager();
  const double base = irradiance_for(imager, 800.0);
  const cv::Mat rest = expose(flat(50, 40, base), imager, 3, 1);
  cv::Mat light = flat(50, 40, base);
  light(cv::Rect(10, 10, 5, 5)) = cv::Scalar(base * 1.01);
  const cv::Mat changed = expose(light, imager, 3, 1);
  for (int row = 0; row < 40; ++row) {
    for (int column = 0; column < 50; ++column) {
      const int difference = changed.at<std::uint16_t>(row, column) - rest.at<std::uint16_t>(row, column);
      const bool inside = row >= 10 && row < 15 && column >= 10 && column < 15;
      if (inside) {
        EXPECT_GE(difference, 1);  // 8 electrons are 2.8 numbers
        EXPECT_LE(difference, 5);
      } else {
        EXPECT_EQ(difference, 0);
      }
    }
  }
}

TEST(Imager, IdealImageIsTheRoundedExpectation) {
  Imager imager = grey_imager();
  imager.prnu = 0.1;
  imager.dsnu_e = 50.0;
  imager.dark_current_e_per_s = 1e5;
  imager.ideal = true;
  for (double electrons = 0.0; electrons < 10000.0; electrons += 97.3) {
    const cv::Mat raw = expose(flat(3, 3, irradiance_for(imager, electrons)), imager, 1, 1);
    const double value = raw.at<std::uint16_t>(1, 1);
    EXPECT_NEAR(value, 20.0 + 0.35 * electrons, 0.5 + 1e-3);
    EXPECT_EQ(cv::norm(raw, cv::Mat(3, 3, CV_16UC1, cv::Scalar(value)), cv::NORM_INF), 0.0);
  }
}

TEST(Imager, RedLightIsSeenByTheRedPixelsAndDevelopsToRed) {
  const std::vector<std::pair<BayerPattern, cv::Point>> red_at = {{BayerPattern::rggb, {0, 0}},
                                                                  {BayerPattern::bggr, {1, 1}},
                                                                  {BayerPattern::grbg, {1, 0}},
                                                                  {BayerPattern::gbrg, {0, 1}}};
  for (const auto& [bayer, red] : red_at) {
    Imager imager = colour_imager(bayer);
    imager.ideal = true;
    const double electrons = 6000.0;
    const auto number = static_cast<int>(std::floor(electrons * imager.gain_DN_per_e + 0.5));
    const cv::Mat light(11, 14, CV_32FC3, cv::Scalar(irradiance_for(imager, electrons, 0), 0.0, 0.0));
    const cv::Mat raw = expose(light, imager, 1, 1);
    for (int row = 0; row < raw.rows; ++row) {
      for (int column = 0; column < raw.cols; ++column) {
        const bool is_red = column % 2 == red.x && row % 2 == red.y;
        ASSERT_EQ(raw.at<std::uint8_t>(row, column), is_red ? number : 0);
        ASSERT_EQ(channel_of(bayer, column, row) == 0, is_red);
      }
    }
    for (const Demosaic method : {Demosaic::bilinear, Demosaic::edge_aware}) {
      const cv::Mat developed = develop(raw, imager, method);
      ASSERT_EQ(developed.type(), CV_8UC3);
      EXPECT_EQ(cv::norm(developed, cv::Mat(11, 14, CV_8UC3, cv::Scalar(0, 0, number)), cv::NORM_INF), 0.0)
          << "pattern " << static_cast<int>(bayer);
    }
  }
}

TEST(Imager, EachBandDevelopsToItsOwnChannel) {
  for (const BayerPattern bayer : {BayerPattern::rggb, BayerPattern::bggr, BayerPattern::grbg, BayerPattern::gbrg}) {
    for (int band = 0; band < 3; ++band) {
      Imager imager = colour_imager(bayer);
      imager.ideal = true;
      cv::Scalar irradiance(0.0, 0.0, 0.0);
      irradiance[band] = irradiance_for(imager, 5100.0, band);
      const cv::Mat developed = develop(expose(cv::Mat(6, 6, CV_32FC3, irradiance), imager, 1, 1), imager);
      cv::Scalar expected(0, 0, 0);
      expected[2 - band] = 130;
      EXPECT_EQ(cv::norm(developed, cv::Mat(6, 6, CV_8UC3, expected), cv::NORM_INF), 0.0);
    }
  }
}

TEST(Imager, GreyStaysGreyAndWhiteWhiteAfterWhiteBalance) {
  for (const int bits : {8, 10, 12, 16}) {
    Imager imager = imx273_skipping(bits, 1e-3);
    imager.ideal = true;
    const Spectrum white = Spectrum::Ones(3);
    imager.white_balance = grey_gains(imager, white);
    EXPECT_DOUBLE_EQ(imager.white_balance.minCoeff(), 1.0);
    const double brightest = response_of(imager).electrons_per_irradiance.rowwise().sum().maxCoeff();
    for (const double share : {0.1, 0.5, 0.9}) {
      const double irradiance = share * imager.full_well_e / brightest;
      const cv::Mat light(12, 12, CV_32FC3, cv::Scalar::all(irradiance));
      for (const Demosaic method : {Demosaic::bilinear, Demosaic::edge_aware}) {
        const cv::Mat developed = develop(expose(light, imager, 1, 1), imager, method);
        for (int row = 0; row < 12; ++row) {
          for (int column = 0; column < 12; ++column) {
            const auto pixel = developed.at<cv::Vec3b>(row, column);
            // Each channel was rounded once to a raw number, then scaled by its gain.
            const double tolerance = 0.5 + 0.5 * imager.white_balance.maxCoeff() * 255.0 / ((1 << bits) - 2);
            for (int channel = 0; channel < 3; ++channel) {
              EXPECT_NEAR(pixel[channel], 255.0 * share, tolerance + 0.01) << bits << " bits";
            }
          }
        }
      }
    }
    const cv::Mat dazzling(12, 12, CV_32FC3, cv::Scalar::all(1e6));
    const cv::Mat white_image = develop(expose(dazzling, imager, 1, 1), imager);
    EXPECT_EQ(cv::norm(white_image, cv::Mat(12, 12, CV_8UC3, cv::Scalar::all(255)), cv::NORM_INF), 0.0);
    const cv::Mat black(12, 12, CV_32FC3, cv::Scalar::all(0));
    EXPECT_EQ(cv::norm(develop(expose(black, imager, 1, 1), imager), cv::NORM_INF), 0.0);
  }
}

TEST(Imager, EightBitGreyDevelopsToItself) {
  Imager imager = grey_imager();
  imager.bits = 8;
  imager.black_level_DN = 0.0;
  cv::Mat raw(1, 256, CV_8UC1);
  for (int i = 0; i < 256; ++i) raw.at<std::uint8_t>(0, i) = static_cast<std::uint8_t>(i);
  EXPECT_TRUE(same_bytes(raw, develop(raw, imager)));
}

TEST(Imager, PresetMeetsThePublishedFiguresOfTheSensor) {
  const Imager imager = imx273_skipping(12, 1.0 / 601.25);
  const ImagerResponse response = response_of(imager);
  EXPECT_NEAR(20.0 * std::log10(std::sqrt(imager.full_well_e)), 40.2, 0.05);             // SNR max, dB
  EXPECT_NEAR(20.0 * std::log10(imager.full_well_e / imager.read_noise_e), 71.4, 0.15);  // dynamic range, dB
  EXPECT_NEAR(imager.black_level_DN + imager.gain_DN_per_e * imager.full_well_e, 4095.0, 1e-9);
  EXPECT_NEAR(noise_e(response, 0.0), 2.8, 0.2);
  EXPECT_NEAR(response.quantisation_e, 1.0 / imager.gain_DN_per_e, 1e-12);
  EXPECT_EQ(expose(cv::Mat(4, 4, CV_32FC3, cv::Scalar::all(0.1)), imager, 1, 1).type(), CV_16UC1);
  EXPECT_EQ(expose(cv::Mat(4, 4, CV_32FC3, cv::Scalar::all(0.1)), imx273_skipping(8, 1e-3), 1, 1).type(), CV_8UC1);
}

TEST(Imager, ResponseTellsTheTemporalNoise) {
  const Imager imager = imx273_skipping(8, 1e-3);
  const cv::Size size(300, 300);
  const FixedPattern pattern = fixed_pattern(imager, size, 1);
  Imager grey = grey_imager();
  grey.gain_DN_per_e = 255.0 / 10000.0;  // coarse steps: 39 electrons
  grey.bits = 8;
  const cv::Mat light = flat(300, 300, irradiance_for(grey, 3000.0));
  const double variance = temporal_variance(expose(light, grey, 1, 1), expose(light, grey, 1, 2));
  EXPECT_NEAR(std::sqrt(variance) / grey.gain_DN_per_e, noise_e(response_of(grey), 3000.0), 0.6);
}

TEST(Imager, BadIrradianceIsRefusedNamingThePixel) {
  const Imager imager = grey_imager();
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), -1e-3}) {
    cv::Mat light = flat(40, 60, 0.1);
    light.at<float>(50, 7) = static_cast<float>(bad);
    light.at<float>(51, 3) = static_cast<float>(bad);
    try {
      expose(light, imager, 1, 1);
      ADD_FAILURE() << "took " << bad;
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr("column 7, row 50"));
    }
  }
  EXPECT_THROW(expose(cv::Mat(), imager, 1, 1), Error);
  EXPECT_THROW(expose(cv::Mat(4, 4, CV_64FC1, cv::Scalar(0)), imager, 1, 1), Error);
  EXPECT_THROW(expose(cv::Mat(4, 4, CV_32FC3, cv::Scalar::all(0)), imager, 1, 1), Error);
  const FixedPattern small = fixed_pattern(imager, {3, 3}, 1);
  EXPECT_THROW(expose(flat(4, 4, 0.1), imager, small, 1, 1), Error);
}

TEST(Imager, BadSettingsAreRefusedNamingTheField) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto refused = [](const char* field, const auto& spoil) {
    Imager imager = colour_imager(BayerPattern::rggb);
    ASSERT_NO_THROW(check(imager));
    spoil(imager);
    try {
      expose(cv::Mat(4, 4, CV_32FC3, cv::Scalar::all(0.1)), imager, 1, 1);
      ADD_FAILURE() << "took a bad " << field;
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr(field));
    }
  };
  refused("exposure_s", [](Imager& i) { i.exposure_s = -1.0; });
  refused("exposure_s", [nan](Imager& i) { i.exposure_s = nan; });
  refused("bits", [](Imager& i) { i.bits = 0; });
  refused("bits", [](Imager& i) { i.bits = 17; });
  refused("active_area_um2", [](Imager& i) { i.active_area_um2 = 0.0; });
  refused("full_well_e", [](Imager& i) { i.full_well_e = 0.0; });
  refused("full_well_e", [](Imager& i) { i.full_well_e = 1e12; });
  refused("read_noise_e", [](Imager& i) { i.read_noise_e = -1.0; });
  refused("dark_current_e_per_s", [nan](Imager& i) { i.dark_current_e_per_s = nan; });
  refused("prnu", [](Imager& i) { i.prnu = -0.1; });
  refused("dsnu_e", [nan](Imager& i) { i.dsnu_e = nan; });
  refused("gain_DN_per_e", [](Imager& i) { i.gain_DN_per_e = 0.0; });
  refused("black_level_DN", [](Imager& i) { i.black_level_DN = 255.0; });
  refused("quantum efficiency", [](Imager& i) { i.quantum_efficiency(1, 1) = 1.1; });
  refused("quantum efficiency", [nan](Imager& i) { i.quantum_efficiency(2, 0) = nan; });
  refused("quantum_efficiency", [](Imager& i) { i.quantum_efficiency.resize(3, 2); });
  refused("channels", [](Imager& i) { i.bayer = BayerPattern::none; });
  refused("wavelength", [](Imager& i) { i.wavelengths_nm[0] = 0.0; });
  refused("white balance", [](Imager& i) { i.white_balance[0] = -1.0; });
  EXPECT_THROW(imx273_skipping(4, 1e-3), Error);
  Imager blind = colour_imager(BayerPattern::rggb);
  EXPECT_THROW(grey_gains(blind, Spectrum::Zero(3)), Error);
  EXPECT_THROW(develop(cv::Mat(4, 4, CV_16UC1, cv::Scalar(0)), blind), Error);
}

}  // namespace
}  // namespace touchstone::render
