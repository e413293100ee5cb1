// Pictures whose pixels are means of a finer mosaic's.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core.hpp>
#include <utility>

#include "core/error.h"
#include "render/imager/imager.h"
#include "tests/render/imager/imager_laws.h"

namespace touchstone::render {
namespace {

constexpr int kBlock = 4;  // mosaic pixels along a side of a binned one

/// Pixels of 2.8 um, whose three filters overlap.
Imager mosaic() {
  Imager imager;
  imager.bits = 8;
  imager.active_area_um2 = 2.8 * 2.8;
  imager.exposure_s = 5e-3;
  imager.wavelengths_nm.resize(3);
  imager.wavelengths_nm << 625.0, 525.0, 460.0;
  imager.quantum_efficiency.resize(3, 3);
  imager.quantum_efficiency << 0.45, 0.06, 0.03,  // red
      0.08, 0.50, 0.10,                           // green
      0.02, 0.10, 0.45;                           // blue
  imager.full_well_e = 6000.0;
  imager.read_noise_e = 6.0;
  imager.dark_current_e_per_s = 2000.0;  // 10 electrons
  imager.prnu = 0.02;
  imager.dsnu_e = 8.0;
  imager.gain_DN_per_e = 255.0 / 6000.0;
  imager.bayer = BayerPattern::rggb;
  return imager;
}

/// The picture of blocks of `kBlock` x `kBlock` of them.
Imager binned() {
  constexpr double kOfAColour = kBlock * kBlock / 4.0;
  Imager imager = mosaic();
  imager.bayer = BayerPattern::binned;
  imager.active_area_um2 *= kBlock * kBlock;
  imager.full_well_e *= kOfAColour;
  imager.read_noise_e *= std::sqrt(kOfAColour);
  imager.dark_current_e_per_s *= kOfAColour;
  imager.dsnu_e *= std::sqrt(kOfAColour);
  imager.prnu /= std::sqrt(kOfAColour);
  imager.gain_DN_per_e /= kOfAColour;
  return imager;
}

/// 16 bits, so that rounding doesn't count, and a black level, so that noise below zero isn't cut.
Imager fine(Imager imager) {
  constexpr double kBlack = 500.0;
  imager.bits = 16;
  imager.gain_DN_per_e *= (65535.0 - kBlack) / 255.0;
  imager.black_level_DN = kBlack;
  return imager;
}

cv::Mat flat(cv::Size size, double red, double green, double blue) {
  return {size, CV_32FC3, cv::Scalar(red, green, blue)};
}

/// Light that gives a channel of the binned picture so many electrons, all of it in the channel's own band.
cv::Mat light_for(const Imager& imager, cv::Size size, int channel, double electrons) {
  cv::Scalar irradiance = cv::Scalar::all(0.0);
  irradiance[channel] = electrons / response_of(imager).electrons_per_irradiance(channel, channel);
  return {size, CV_32FC3, irradiance};
}

cv::Mat channel_of_picture(const cv::Mat& picture, int channel) {
  cv::Mat one;
  cv::extractChannel(picture, one, channel);
  one.convertTo(one, CV_64F);
  return one;
}

struct MeanAndSpread {
  double mean, variance;
};

MeanAndSpread spread_of(const cv::Mat& numbers) {
  cv::Scalar mean;
  cv::Scalar deviation;
  cv::meanStdDev(numbers, mean, deviation);
  return {mean[0], deviation[0] * deviation[0]};
}

/// Half the variance of the difference: what changes from frame to frame, without the fixed pattern.
double temporal_variance(const cv::Mat& a, const cv::Mat& b) {
  return spread_of(a - b).variance / 2.0;
}

/// Means over the pixels of a colour in each block of a raw mosaic.
cv::Mat binned_by_hand(const cv::Mat& raw, BayerPattern bayer, int channel) {
  cv::Mat means = cv::Mat::zeros(raw.rows / kBlock, raw.cols / kBlock, CV_64F);
  const double pixels = kBlock * kBlock * (channel == 1 ? 0.5 : 0.25);
  for (int row = 0; row < raw.rows; ++row) {
    for (int column = 0; column < raw.cols; ++column) {
      if (channel_of(bayer, column, row) != channel) continue;
      means.at<double>(row / kBlock, column / kBlock) += raw.at<std::uint16_t>(row, column) / pixels;
    }
  }
  return means;
}

TEST(BinnedImager, EachChannelsVarianceLiesOnItsPhotonTransferLine) {
  Imager imager = fine(binned());
  imager.bits = 12;
  imager.gain_DN_per_e /= 16.0;
  imager.black_level_DN = 30.0;
  const cv::Size size(400, 400);
  const FixedPattern pattern = fixed_pattern(imager, size, 7);
  for (int channel = 0; channel < 3; ++channel) {
    const Imager own = channel_imager(imager, channel);
    const double gain = own.gain_DN_per_e;
    const double dark_e = own.dark_current_e_per_s * own.exposure_s;
    const double dark_variance = own.read_noise_e * own.read_noise_e + dark_e;
    for (const double share : {0.0, 0.02, 0.1, 0.4, 0.8}) {
      const double electrons = share * own.full_well_e;
      const cv::Mat light = light_for(imager, size, channel, electrons);
      const cv::Mat a = channel_of_picture(expose(light, imager, pattern, 7, 1), channel);
      const cv::Mat b = channel_of_picture(expose(light, imager, pattern, 7, 2), channel);
      const double above_dark = gain * electrons;
      const double line = gain * gain * dark_variance + 1.0 / 12.0 + gain * above_dark;
      // The standard error of a variance of n samples is sqrt(2/n) of it: 0.35 %.
      EXPECT_NEAR(temporal_variance(a, b) / line, 1.0, 0.015) << "channel " << channel << ", " << share;
      const double mean = imager.black_level_DN + gain * (electrons + dark_e);
      EXPECT_NEAR(spread_of(a).mean, mean, 0.03 + 2e-4 * mean) << "channel " << channel << ", " << share;
    }
  }
}

TEST(BinnedImager, IsTheMeanOfTheMosaicsBlocks) {
  const Imager pixels = fine(mosaic());
  const Imager blocks = fine(binned());
  const cv::Size size(200, 150);
  const cv::Size mosaic_size(size.width * kBlock, size.height * kBlock);
  const FixedPattern pattern = fixed_pattern(blocks, size, 3);
  const FixedPattern mosaic_pattern = fixed_pattern(pixels, mosaic_size, 3);
  for (const double level : {0.0, 0.003, 0.03}) {
    const auto raw = [&](std::uint64_t frame) {
      return expose(flat(size, level, 0.7 * level, 0.5 * level), blocks, pattern, 3, frame);
    };
    const auto mosaic_raw = [&](std::uint64_t frame) {
      return expose(flat(mosaic_size, level, 0.7 * level, 0.5 * level), pixels, mosaic_pattern, 3, frame);
    };
    const std::array<cv::Mat, 2> frames = {raw(1), raw(2)};
    const std::array<cv::Mat, 2> mosaic_frames = {mosaic_raw(1), mosaic_raw(2)};
    for (int channel = 0; channel < 3; ++channel) {
      SCOPED_TRACE(testing::Message() << "level " << level << ", channel " << channel);
      const cv::Mat a = channel_of_picture(frames[0], channel);
      const cv::Mat b = channel_of_picture(frames[1], channel);
      const cv::Mat hand_a = binned_by_hand(mosaic_frames[0], pixels.bayer, channel);
      const cv::Mat hand_b = binned_by_hand(mosaic_frames[1], pixels.bayer, channel);
      const double variance = temporal_variance(a, b);
      const double all = spread_of(a).variance;  // with the fixed pattern
      // Of 30,000 pixels a variance is known to 0.8 %, a mean to 0.6 % of the spread.
      EXPECT_NEAR(spread_of(a).mean, spread_of(hand_a).mean, 5.0 * std::sqrt(2.0 * all / 30000.0) + 0.01);
      EXPECT_NEAR(temporal_variance(hand_a, hand_b) / variance, 1.0, 0.05);
      EXPECT_NEAR(spread_of(hand_a).variance / all, 1.0, 0.05);
    }
  }
}

TEST(BinnedImager, AreaIsSharedByTheColours) {
  const Imager imager = binned();
  const double photons = 16 * 2.8e-6 * 2.8e-6 * 5e-3 / (6.62607015e-34 * 299792458.0);  // per W/m^2 and m
  const ImagerResponse response = response_of(imager);
  EXPECT_NEAR(response.electrons_per_irradiance(0, 0) / (0.25 * 0.45 * photons * 625e-9), 1.0, 1e-12);
  EXPECT_NEAR(response.electrons_per_irradiance(1, 1) / (0.5 * 0.50 * photons * 525e-9), 1.0, 1e-12);
  EXPECT_NEAR(response.electrons_per_irradiance(2, 1) / (0.25 * 0.10 * photons * 525e-9), 1.0, 1e-12);
}

TEST(BinnedImager, TheResponseIsThatOfTheNoisiestChannel) {
  const Imager imager = binned();
  const auto noise = [](const ImagerResponse& response) { return noise_e(response, 0.2 * response.full_well_e); };
  double most = 0.0;
  for (int channel = 0; channel < 3; ++channel) {
    const ImagerResponse own = response_of(channel_imager(imager, channel));
    EXPECT_LT((own.electrons_per_irradiance - response_of(imager).electrons_per_irradiance.row(channel)).norm(), 1e-9);
    most = std::max(most, noise(own));
  }
  EXPECT_DOUBLE_EQ(noise(response_of(imager)), most);
}

TEST(BinnedImager, ColoursAreThoseOfAMosaicUnderTheSameFlatLight) {
  const cv::Size size(40, 30);
  for (const bool ideal : {true, false}) {
    Imager pixels = mosaic();
    Imager blocks = binned();
    pixels.prnu = blocks.prnu = pixels.dsnu_e = blocks.dsnu_e = 0.0;
    pixels.ideal = blocks.ideal = ideal;
    pixels.white_balance = blocks.white_balance = grey_gains(blocks, Spectrum::Ones(3));
    for (const cv::Scalar& light : {cv::Scalar(0.06, 0.06, 0.06), cv::Scalar(0.05, 0.01, 0.0),
                                    cv::Scalar(0.0, 0.05, 0.02), cv::Scalar(0.01, 0.0, 0.06)}) {
      const cv::Mat irradiance(size, CV_32FC3, light);
      const cv::Scalar of_mosaic = cv::mean(develop(expose(irradiance, pixels, 1, 1), pixels));
      const cv::Scalar of_blocks = cv::mean(develop(expose(irradiance, blocks, 1, 1), blocks));
      // Ideal pictures round each number once, then scale it by the white balance.
      const double tolerance = ideal ? 0.5 + blocks.white_balance.maxCoeff() : 0.8;
      for (int channel = 0; channel < 3; ++channel) {
        EXPECT_NEAR(of_blocks[channel], of_mosaic[channel], tolerance) << light << " channel " << channel;
      }
    }
  }
}

TEST(BinnedImager, AGreyEdgeHasNoColouredFringes) {
  cv::Mat light(20, 20, CV_32FC3, cv::Scalar::all(0.005));
  light(cv::Rect(9, 0, 11, 20)) = cv::Scalar::all(0.06);
  const auto most_colour = [&](Imager imager) {
    imager.ideal = true;
    imager.white_balance = grey_gains(imager, Spectrum::Ones(3));
    const cv::Mat picture = develop(expose(light, imager, 1, 1), imager);
    int most = 0;
    for (int row = 0; row < picture.rows; ++row) {
      for (int column = 0; column < picture.cols; ++column) {
        const auto pixel = picture.at<cv::Vec3b>(row, column);
        const auto [least, largest] = std::minmax({pixel[0], pixel[1], pixel[2]});
        most = std::max(most, largest - least);
      }
    }
    return most;
  };
  EXPECT_LE(most_colour(binned()), 2);
  EXPECT_GE(most_colour(mosaic()), 30) << "else the test sees nothing";
}

TEST(BinnedImager, GreyLightGivesEqualNumbersUpToTheFullWell) {
  Imager imager = binned();
  imager.ideal = true;
  imager.quantum_efficiency = Eigen::Matrix3d::Constant(0.3);
  const double per_irradiance = response_of(imager).electrons_per_irradiance.row(0).sum();
  for (const double share : {0.1, 0.5, 0.99, 1.0, 3.0, 1e6}) {
    const double level = share * imager.full_well_e / per_irradiance;
    const cv::Mat raw = expose(flat({4, 3}, level, level, level), imager, 1, 1);
    const double number = std::floor(255.0 * std::min(1.0, share) + 0.5);
    EXPECT_LE(cv::norm(raw, cv::Mat(3, 4, CV_8UC3, cv::Scalar::all(number)), cv::NORM_INF), share < 1.0 ? 1.0 : 0.0);
  }
}

TEST(BinnedImager, DevelopOnlyPutsTheChannelsInOrder) {
  const Imager imager = binned();
  cv::Mat raw(1, 256, CV_8UC3);
  for (int i = 0; i < 256; ++i) {
    const auto number = static_cast<std::uint8_t>(i);
    raw.at<cv::Vec3b>(0, i) = {number, static_cast<std::uint8_t>(255 - i), 7};
  }
  const cv::Mat developed = develop(raw, imager);
  ASSERT_EQ(developed.type(), CV_8UC3);
  for (int i = 0; i < 256; ++i)
    EXPECT_EQ(developed.at<cv::Vec3b>(0, i), cv::Vec3b(7, raw.at<cv::Vec3b>(0, i)[1], raw.at<cv::Vec3b>(0, i)[0]));
  EXPECT_TRUE(same_bytes(developed, develop(raw, imager, Demosaic::edge_aware)));
  const Imager deep = fine(imager);
  const cv::Mat one = expose(flat({1, 1}, 0.01, 0.01, 0.01), deep, 1, 1);
  EXPECT_EQ(one.type(), CV_16UC3);
  EXPECT_EQ(develop(one, deep).type(), CV_8UC3);
}

TEST(BinnedImager, NoiseAndFixedPatternOfTheChannelsAreIndependent) {
  Imager imager = fine(binned());
  const cv::Size size(300, 300);
  const FixedPattern pattern = fixed_pattern(imager, size, 5);
  const cv::Mat raw =
      expose(flat(size, 0.02, 0.02, 0.02), imager,
             FixedPattern{cv::Mat(size, CV_32FC3, {1, 1, 1}), cv::Mat(size, CV_32FC3, {0, 0, 0})}, 5, 0);
  for (const cv::Mat& values : {raw, pattern.gain, pattern.offset_e}) {
    for (const auto& [first, second] : {std::pair{0, 1}, {0, 2}, {1, 2}}) {
      cv::Mat a = channel_of_picture(values, first);
      cv::Mat b = channel_of_picture(values, second);
      a -= cv::mean(a);
      b -= cv::mean(b);
      EXPECT_LT(std::abs(a.dot(b)) / std::sqrt(a.dot(a) * b.dot(b)), 4.5 / 300.0) << first << second;
    }
  }
  // The spread over pixels is the stated one of each channel.
  for (int channel = 0; channel < 3; ++channel) {
    const Imager own = channel_imager(imager, channel);
    const double gain = std::sqrt(spread_of(channel_of_picture(pattern.gain, channel)).variance);
    const double offset = std::sqrt(spread_of(channel_of_picture(pattern.offset_e, channel)).variance);
    EXPECT_NEAR(gain / own.prnu, 1.0, 0.01) << channel;
    EXPECT_NEAR(offset / own.dsnu_e, 1.0, 0.01) << channel;
  }
}

TEST(BinnedImager, SameBytesWithAnyNumberOfThreads) {
  expect_same_bytes_on_any_threads(binned(), 1e-3F, 0.03F);
}

TEST(BinnedImager, AChannelsNoiseDoesNotDependOnTheOthersLight) {
  Imager imager = binned();
  imager.quantum_efficiency = Eigen::Matrix3d::Identity() * 0.5;
  const cv::Size size(60, 40);
  const cv::Mat rest = expose(flat(size, 0.01, 0.03, 0.02), imager, 3, 1);
  for (const double red : {0.0, 0.011, 1e4}) {  // the last one far above the full well
    const cv::Mat changed = expose(flat(size, red, 0.03, 0.02), imager, 3, 1);
    for (const int channel : {1, 2}) {
      EXPECT_TRUE(same_bytes(channel_of_picture(rest, channel), channel_of_picture(changed, channel))) << red;
    }
    EXPECT_FALSE(same_bytes(channel_of_picture(rest, 0), channel_of_picture(changed, 0))) << red;
  }
}

TEST(BinnedImager, BadInputIsRefused) {
  const Imager imager = binned();
  const auto refused = [](const char* what, const auto& call) {
    try {
      call();
      ADD_FAILURE() << "took it: " << what;
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr(what));
    }
  };
  refused("three channels", [&] { develop(cv::Mat(4, 4, CV_8UC1, cv::Scalar(0)), imager); });
  refused("three channels", [&] { develop(cv::Mat(4, 4, CV_16UC3, cv::Scalar::all(0)), imager); });
  refused("one channel", [&] { develop(cv::Mat(4, 4, CV_8UC3, cv::Scalar::all(0)), mosaic()); });
  refused("3 channels", [&] { expose(flat({4, 4}, 0.1, 0.1, 0.1), imager, fixed_pattern(mosaic(), {4, 4}, 1), 1, 1); });
  Imager grey = imager;
  grey.quantum_efficiency = QuantumEfficiency(imager.quantum_efficiency.row(0));
  refused("1 channels; a colour sensor has 3", [&] { check(grey); });
  cv::Mat light = flat({4, 4}, 0.1, 0.1, 0.1);
  light.at<cv::Vec3f>(2, 1)[2] = -1.0F;
  refused("column 1, row 2), band 2", [&] { expose(light, imager, 1, 1); });
}

}  // namespace
}  // namespace touchstone::render
