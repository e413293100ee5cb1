// What a camera makes of its numbers: tone curve, JPEG, hot pixels; and that without them all is as it was.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "core/random.h"
#include "render/imager/imager.h"
#include "render/sampling/noise_quantile.h"
#include "tests/render/imager/imager_laws.h"
#include "tests/support/message_of.h"

namespace touchstone::render {
namespace {

using test::message_of;
using ::testing::AllOf;
using ::testing::HasSubstr;

/// A grey sensor of one band, 16 bits of the full well.
Imager grey_imager(int bits = 16) {
  Imager imager;
  imager.bits = bits;
  imager.active_area_um2 = 10.0;
  imager.exposure_s = 1e-3;
  imager.quantum_efficiency = QuantumEfficiency::Constant(1, 1, 0.5);
  imager.wavelengths_nm = Spectrum::Constant(1, 540.0);
  imager.full_well_e = 10000.0;
  imager.read_noise_e = 3.0;
  imager.prnu = 0.01;
  imager.dsnu_e = 2.0;
  imager.gain_DN_per_e = ((1 << bits) - 1) / 10000.0;
  return imager;
}

/// The 8 bit number that a raw one of 16 bits is delivered as.
int delivered_number(const ToneCurve& curve, double linear) {
  Imager imager = grey_imager();
  imager.tone_curve = curve;
  const cv::Mat raw(1, 1, CV_16UC1, cv::Scalar(std::round(65535.0 * linear)));
  return develop(raw, imager).at<std::uint8_t>(0, 0);
}

// [IEC61966]: 0.0031308 is 0.0404 (10.3 of 255), 0.01 is 0.0999 (25.5), the middle grey 0.18 is 0.4614 (117.6), 0.5 is
// 0.7354 (187.5), and half of the numbers, 127.5, are given by 0.2140.
TEST(ToneCurve, OfSrgbHasTheStandardsValues) {
  const SrgbTone srgb;
  EXPECT_NEAR(delivered(srgb, 0.0031308), 0.04045, 1e-5);
  EXPECT_NEAR(delivered(srgb, 0.18), 0.461356, 1e-6);
  EXPECT_NEAR(delivered(srgb, 0.214041), 0.5, 1e-6);
  EXPECT_NEAR(delivered(srgb, 0.5), 0.735357, 1e-6);
  EXPECT_EQ(delivered_number(srgb, 0.0), 0);
  EXPECT_EQ(delivered_number(srgb, 0.0031308), 10);
  EXPECT_EQ(delivered_number(srgb, 0.01), 25);
  EXPECT_EQ(delivered_number(srgb, 0.18), 118);
  EXPECT_EQ(delivered_number(srgb, 0.5), 188);
  EXPECT_EQ(delivered_number(srgb, 1.0), 255);
}

// 255 x 0.2^(1/2.2) = 122.7; the points (0, 0), (0.25, 0.6), (1, 1) give 153 at the second one.
TEST(ToneCurve, OfAGammaOrOfPointsIsWhatTheySay) {
  EXPECT_EQ(delivered_number(GammaTone{2.2}, 0.2), 123);
  EXPECT_EQ(delivered_number(GammaTone{1.0}, 0.2), 51);
  const MonotoneCurve points({{0.0, 0.0}, {0.25, 0.6}, {1.0, 1.0}});
  EXPECT_EQ(delivered_number(points, 0.25), 153);
  EXPECT_EQ(delivered_number(points, 1.0), 255);
}

TEST(ToneCurve, IsTheSameOfAllNumbersAndHasAnInverse) {
  const MonotoneCurve points({{0.0, 0.05}, {0.1, 0.4}, {0.6, 0.8}, {1.0, 0.97}});
  for (const ToneCurve& curve : {ToneCurve(SrgbTone{}), ToneCurve(GammaTone{0.7}), ToneCurve(points)}) {
    Imager imager = grey_imager();
    imager.tone_curve = curve;
    cv::Mat raw(256, 256, CV_16UC1);
    for (int level = 0; level < 65536; ++level)
      raw.at<std::uint16_t>(level / 256, level % 256) = static_cast<std::uint16_t>(level);
    const cv::Mat shown = develop(raw, imager);
    for (int level = 0; level < 65536; ++level) {
      const double wanted = std::floor(255.0 * delivered(curve, level / 65535.0) + 0.5);
      ASSERT_EQ(shown.at<std::uint8_t>(level / 256, level % 256), wanted) << level;
    }
    for (const double linear : {0.001, 0.2, 0.77, 1.0}) {
      EXPECT_NEAR(linear_of(curve, delivered(curve, linear)), linear, 1e-12);
    }
  }
}

// Behind gains (2, 1, 1/2) the numbers (40, 80, 160) are grey: 80 each, which sRGB's curve makes
// 255 (1.055 (80/255)^(1/2.4) - 0.055) = 152. Before them they would be three colours.
TEST(ToneCurve, ComesAfterTheWhiteBalance) {
  Imager imager = grey_imager(8);
  imager.bayer = BayerPattern::binned;
  imager.quantum_efficiency = QuantumEfficiency::Constant(3, 1, 0.5);
  imager.white_balance = {2.0, 1.0, 0.5};
  imager.tone_curve = SrgbTone{};
  const cv::Mat shown = develop(cv::Mat(2, 2, CV_8UC3, cv::Scalar(40, 80, 160)), imager);
  EXPECT_EQ(shown.at<cv::Vec3b>(1, 1), cv::Vec3b(152, 152, 152));
}

// A ramp of 1 in 4 pixels. In a block of 8 x 8 its half a step up is 3.6 of the first cosine, whose quantum at quality
// 50 is 11, and less of the others: all of them become 0. What is left is the block's mean, 2 k + 1/2 in block k, in
// quanta of 16 / 8 = 2: 2 k in all of its pixels.
TEST(JpegLoss, AtQuality50ASlowRampBecomesStepsOf8Pixels) {
  cv::Mat ramp(32, 256, CV_8UC1);
  for (int y = 0; y < ramp.rows; ++y) {
    for (int x = 0; x < ramp.cols; ++x) ramp.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(x / 4);
  }
  const cv::Mat left = through_jpeg(ramp, {.quality = 50});
  for (int y = 0; y < ramp.rows; ++y) {
    for (int x = 0; x < ramp.cols; ++x) ASSERT_EQ(left.at<std::uint8_t>(y, x), 2 * (x / 8)) << x << ", " << y;
  }
}

cv::Mat noise_picture(int type) {
  cv::Mat picture(61, 83, type);
  RandomStream random(3, 0, Purpose::kTest);
  for (int y = 0; y < picture.rows; ++y) {
    std::uint8_t* row = picture.ptr<std::uint8_t>(y);
    for (int i = 0; i < picture.cols * picture.channels(); ++i) row[i] = static_cast<std::uint8_t>(random() >> 24);
  }
  return picture;
}

// At quality 100 each cosine is kept to 1/2, which makes a deviation of 0.29 of a number, and numbers are rounded: off
// by 0 or 1. Colours go through Y, Cb and Cr, each of which is then off by up to about 1: blue, which is Y + 1.772 Cb,
// by up to 3 and the rounding, on average by half a number.
TEST(JpegLoss, AtQuality100IsWithinOneNumberOfGreyAndAFewOfColour) {
  const cv::Mat grey = noise_picture(CV_8UC1);
  EXPECT_LE(cv::norm(grey, through_jpeg(grey, {.quality = 100}), cv::NORM_INF), 1.0);
  const cv::Mat colours = noise_picture(CV_8UC3);
  const cv::Mat left = through_jpeg(colours, {.quality = 100});
  EXPECT_LE(cv::norm(colours, left, cv::NORM_INF), 4.0);
  EXPECT_LT(cv::norm(colours, left, cv::NORM_L1) / (3.0 * static_cast<double>(colours.total())), 0.6);
}

// Columns that are red and blue by turns: with one colour for each 2 x 2 pixels both become their mean.
TEST(JpegLoss, With420ColourIsSharedByTwoByTwoPixels) {
  cv::Mat stripes(32, 32, CV_8UC3);
  for (int y = 0; y < stripes.rows; ++y) {
    for (int x = 0; x < stripes.cols; ++x) {
      stripes.at<cv::Vec3b>(y, x) = x % 2 == 0 ? cv::Vec3b(40, 90, 200) : cv::Vec3b(200, 90, 40);
    }
  }
  const auto contrast = [&](JpegChroma chroma) {
    const cv::Mat left = through_jpeg(stripes, {.quality = 100, .chroma = chroma});
    return left.at<cv::Vec3b>(16, 16)[2] - left.at<cv::Vec3b>(16, 17)[2];
  };
  EXPECT_NEAR(contrast(JpegChroma::full), 160, 4);
  EXPECT_LT(contrast(JpegChroma::quarter), 40);  // what brightness alone has: 0.299 160 - 0.114 160 = 30
}

TEST(JpegLoss, IsPartOfWhatIsDeliveredButOfAnIdealPicture) {
  Imager imager = grey_imager(8);
  imager.jpeg = JpegSettings{.quality = 30};
  const cv::Mat light(64, 64, CV_32FC1, cv::Scalar(0.1));
  Imager lossless = imager;
  lossless.jpeg.reset();
  const cv::Mat raw = expose(light, imager, 1, 1);
  EXPECT_TRUE(same_bytes(develop(raw, imager), through_jpeg(develop(raw, lossless), *imager.jpeg)));
  EXPECT_FALSE(same_bytes(develop(raw, imager), develop(raw, lossless)));
  imager.ideal = true;
  EXPECT_TRUE(same_bytes(develop(raw, imager), develop(raw, lossless)));
  cv::Mat once;
  {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
    once = develop(raw, lossless);
  }
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 4);
  EXPECT_TRUE(same_bytes(once, develop(raw, lossless)));
}

// Of 640 x 480 pixels a share of 1e-3 is 307 with a standard deviation of 17.5.
TEST(HotPixels, AreAsManyAsTheirShareAndTheUnitsOwn) {
  Imager imager = grey_imager();
  imager.hot_pixels = {.share = 1e-3, .dark_current_e_per_s = 4e5, .spread = 0.5};
  const cv::Size size(640, 480);
  const cv::Mat hot = fixed_pattern(imager, size, 7).hot_e_per_s;
  const int count = cv::countNonZero(hot);
  EXPECT_NEAR(count, 307.2, 3.0 * 17.5);
  EXPECT_TRUE(same_bytes(hot, fixed_pattern(imager, size, 7).hot_e_per_s));
  EXPECT_FALSE(same_bytes(hot, fixed_pattern(imager, size, 8).hot_e_per_s)) << "another unit";
  // The logarithms' mean and deviation: 0.5 / sqrt(307) = 0.029 and 0.5 / sqrt(2 x 307) = 0.020 are their own errors.
  double sum = 0.0, squares = 0.0;
  for (int y = 0; y < hot.rows; ++y) {
    for (int x = 0; x < hot.cols; ++x) {
      if (hot.at<float>(y, x) == 0.0F) continue;
      const double away = std::log(hot.at<float>(y, x) / 4e5);
      sum += away;
      squares += away * away;
    }
  }
  EXPECT_NEAR(sum / count, 0.0, 3.0 * 0.029);
  EXPECT_NEAR(std::sqrt(squares / count), 0.5, 3.0 * 0.020);
  Imager cold = imager;
  cold.hot_pixels = {};
  EXPECT_TRUE(same_bytes(fixed_pattern(imager, size, 7).gain, fixed_pattern(cold, size, 7).gain));
  EXPECT_TRUE(same_bytes(fixed_pattern(imager, size, 7).offset_e, fixed_pattern(cold, size, 7).offset_e));
  EXPECT_TRUE(fixed_pattern(cold, size, 7).hot_e_per_s.empty());
}

// 4e5 e-/s in 1 ms are 400 e-, with a noise of sqrt(400 + 3^2 + 2^2) = 20; 1 e- is 6.55 numbers. In twice the exposure
// they are 800. All other pixels keep their numbers.
TEST(HotPixels, HaveTheirDarkCurrentInTheDark) {
  Imager imager = grey_imager();
  imager.black_level_DN = 500.0;  // below it noise is cut off
  Imager cold = imager;
  imager.hot_pixels = {.share = 1e-2, .dark_current_e_per_s = 4e5};
  const cv::Mat dark(480, 640, CV_32FC1, cv::Scalar(0.0));
  const cv::Mat is_hot = fixed_pattern(imager, dark.size(), 5).hot_e_per_s > 0.0;
  for (const double exposure_s : {1e-3, 2e-3}) {
    imager.exposure_s = cold.exposure_s = exposure_s;
    cv::Mat with, without;
    expose(dark, imager, 5, 1).convertTo(with, CV_64F);
    expose(dark, cold, 5, 1).convertTo(without, CV_64F);
    cv::Mat excess;
    cv::subtract(with, without, excess);
    excess /= imager.gain_DN_per_e;
    const double electrons = 4e5 * exposure_s;
    const double error = std::sqrt(electrons / cv::countNonZero(is_hot));
    EXPECT_NEAR(cv::mean(excess, is_hot)[0], electrons, 4.0 * error);
    EXPECT_EQ(cv::norm(excess, cv::NORM_INF, ~is_hot), 0.0);
  }
  imager.ideal = true;
  EXPECT_EQ(cv::norm(expose(dark, imager, 5, 1), cv::Mat(480, 640, CV_16UC1, cv::Scalar(500)), cv::NORM_INF), 0.0);
}

TEST(HotPixels, AreTheSameFromAnyNumberOfThreads) {
  Imager imager = grey_imager(8);
  imager.hot_pixels = {.share = 0.05, .dark_current_e_per_s = 1e6, .spread = 1.0};
  imager.bayer = BayerPattern::binned;
  imager.quantum_efficiency = QuantumEfficiency::Constant(3, 3, 0.3);
  imager.wavelengths_nm = Spectrum::Constant(3, 540.0);
  expect_same_bytes_on_any_threads(imager, 1e-3F, 0.02F);
}

// The linear model's own numbers, put together here once more: without any of the steps that a camera may have, a frame
// is exactly them, min(Poisson, full well) + offset + read noise, times K, rounded and, with 8 bits, delivered as it
// is.
TEST(CameraPipeline, WithoutAnyOfItsStepsAFrameIsThatOfTheLinearModel) {
  Imager imager = grey_imager(8);
  cv::Mat light(48, 64, CV_32FC1);
  for (int y = 0; y < light.rows; ++y) {
    for (int x = 0; x < light.cols; ++x) light.at<float>(y, x) = 0.0005F * static_cast<float>(x * y);
  }
  constexpr std::uint64_t kSeed = 11;
  constexpr std::uint64_t kFrame = 3;
  const FixedPattern pattern = fixed_pattern(imager, light.size(), kSeed);
  const double per_light = response_of(imager).electrons_per_irradiance(0, 0);
  cv::Mat wanted(light.size(), CV_8UC1);
  for (int y = 0; y < light.rows; ++y) {
    for (int x = 0; x < light.cols; ++x) {
      const std::uint64_t pixel = (static_cast<std::uint64_t>(y) << 16) | static_cast<std::uint64_t>(x);
      RandomStream stream(kSeed, (kFrame << 32) | pixel, Purpose::kImagerNoise);
      const double mean = per_light * static_cast<double>(light.at<float>(y, x)) * pattern.gain.at<float>(y, x);
      double electrons = std::min(poisson_quantile(mean, stream.uniform()), imager.full_well_e);
      electrons += pattern.offset_e.at<float>(y, x) + imager.read_noise_e * normal_quantile(stream.uniform());
      wanted.at<std::uint8_t>(y, x) =
          static_cast<std::uint8_t>(std::clamp(imager.gain_DN_per_e * electrons, 0.0, 255.0) + 0.5);
    }
  }
  const cv::Mat frame = develop(expose(light, imager, pattern, kSeed, kFrame), imager);
  EXPECT_GT(cv::mean(frame)[0], 20.0);
  EXPECT_TRUE(same_bytes(frame, wanted));
}

TEST(CameraPipeline, RefusesStepsThatMakeNoSense) {
  const auto message = [](const auto& change) {
    Imager imager = grey_imager();
    change(imager);
    return message_of([&] { check(imager); });
  };
  EXPECT_EQ(message([](Imager&) {}), "no error");
  EXPECT_THAT(message([](Imager& i) { i.tone_curve = GammaTone{0.0}; }), AllOf(HasSubstr("gamma"), HasSubstr("0.1")));
  EXPECT_THAT(message([](Imager& i) {
                i.tone_curve = MonotoneCurve({{0, 0}, {0.5, 0.7}, {1, 0.6}});
              }),
              AllOf(HasSubstr("point 3"), HasSubstr("0.6"), HasSubstr("0.7")));
  EXPECT_THAT(message([](Imager& i) { i.tone_curve = MonotoneCurve({{0, 0}, {0.5, 0.7}}); }), HasSubstr("0 to 1"));
  EXPECT_THAT(message([](Imager& i) { i.tone_curve = MonotoneCurve({{0, 0}, {1, 1.2}}); }), HasSubstr("1.2"));
  EXPECT_THAT(message([](Imager& i) { i.jpeg = JpegSettings{.quality = 0}; }), HasSubstr("1 to 100"));
  EXPECT_THAT(message([](Imager& i) { i.hot_pixels.share = 1.5; }), HasSubstr("share"));
  EXPECT_THAT(message([](Imager& i) { i.hot_pixels.spread = -1.0; }), HasSubstr("spread"));
  EXPECT_THAT(message([](Imager& i) { i.auto_exposure = AutoExposure{.time_constant_s = 0.0}; }),
              HasSubstr("time_constant_s"));
  EXPECT_THAT(message([](Imager& i) { i.auto_exposure = AutoExposure{.mean_level = 1.0}; }), HasSubstr("mean_level"));
  EXPECT_THAT(message([](Imager& i) { i.auto_exposure = AutoExposure{.lowest = 4.0}; }), HasSubstr("from 4 to 4"));
  EXPECT_THAT(message([](Imager& i) { i.auto_white_balance = AutoWhiteBalance{}; }), HasSubstr("grey"));
}

}  // namespace
}  // namespace touchstone::render
