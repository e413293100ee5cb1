#include "sensors/texture/texture_feature.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/random.h"
#include "sensors/image/gaussian_pyramid.h"
#include "sensors/texture/height_gray.h"
#include "tests/support/message_of.h"

namespace touchstone::sensors {
namespace {

using testing::HasSubstr;
using touchstone::test::message_of;

cv::Mat random_image(int columns, int rows, std::uint64_t seed) {
  RandomStream random(seed, 0, Purpose::kTest);
  cv::Mat image(rows, columns, CV_8UC1);
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) image.at<std::uint8_t>(j, i) = static_cast<std::uint8_t>(random() >> 24);
  }
  return image;
}

TEST(GaussianPyramid, TheKernelIsBurtAndAdelsonsWithThreeEighths) {
  constexpr double kA = 0.375;
  const std::array<double, 5> kernel{0.25 - 0.5 * kA, 0.25, kA, 0.25, 0.25 - 0.5 * kA};
  for (const int at : {10, 11}) {  // a point that the coarser level has, and one that it hasn't
    cv::Mat point(21, 21, CV_8UC1, cv::Scalar(0));
    point.at<std::uint8_t>(at, at) = 255;
    const cv::Mat half = gaussian_pyramid(point, 2)[1];
    ASSERT_EQ(half.size(), cv::Size(11, 11));
    for (int j = 0; j < half.rows; ++j) {
      for (int i = 0; i < half.cols; ++i) {
        const int x = at - 2 * i + 2, y = at - 2 * j + 2;
        const double expected = x >= 0 && x < 5 && y >= 0 && y < 5 ? 255.0 * kernel[x] * kernel[y] : 0.0;
        EXPECT_NEAR(half.at<std::uint8_t>(j, i), expected, 0.5 + 1e-9);
      }
    }
  }
}

TEST(GaussianPyramid, KeepsMeanBrightnessAndAverages) {
  const cv::Mat noise = random_image(257, 257, 3);
  const std::vector<cv::Mat> levels = gaussian_pyramid(noise, 4);
  // One level passes (1 + 16 + 36 + 16 + 1) / 256 = 35/128 of white noise's spread along each axis.
  cv::Scalar mean, spread, mean_of_noise, spread_of_noise;
  cv::meanStdDev(noise, mean_of_noise, spread_of_noise);
  cv::meanStdDev(levels[1], mean, spread);
  EXPECT_NEAR(mean[0], mean_of_noise[0], 1.0);
  EXPECT_NEAR(spread[0] / spread_of_noise[0], 35.0 / 128.0, 0.01);
  for (const cv::Mat& level : levels) {
    cv::meanStdDev(level, mean, spread);
    EXPECT_NEAR(mean[0], mean_of_noise[0], 2.0);
  }
  const cv::Mat flat = gaussian_pyramid(cv::Mat(100, 60, CV_8UC1, cv::Scalar(91)), 4)[3];
  EXPECT_EQ(flat.size(), cv::Size(8, 13));
  EXPECT_EQ(cv::countNonZero(flat != 91), 0);
}

TEST(GaussianPyramid, RefusesWhatCannotBeHalved) {
  EXPECT_THAT(message_of([] { gaussian_pyramid(cv::Mat(2, 9, CV_8UC1), 2); }), HasSubstr("9 x 2 px is too small"));
  EXPECT_THAT(message_of([] { gaussian_pyramid(cv::Mat(9, 9, CV_8UC1), 9); }), HasSubstr("from 1 to 8"));
  EXPECT_THAT(message_of([] { gaussian_pyramid({}, 1); }), HasSubstr("gray image"));
  EXPECT_THAT(message_of([] { gaussian_pyramid(cv::Mat(9, 9, CV_32FC1), 1); }), HasSubstr("8 bit"));
}

TEST(TextureFeature, IsTheWeightedHistogramsOfAllLevels) {
  const cv::Mat image = random_image(200, 200, 5);
  const TextureOperator op;
  const Eigen::VectorXf feature = texture_feature(image, op);
  ASSERT_EQ(feature.size(), 72);
  EXPECT_NEAR(feature.squaredNorm(), 1.0, 1e-6);
  // 196^2 + 2 96^2 + 4 46^2 + 8 21^2 weighted labels [Li2015, eq. 11].
  const double all = 196.0 * 196 + 2.0 * 96 * 96 + 4.0 * 46 * 46 + 8.0 * 21 * 21;
  const std::vector<cv::Mat> levels = gaussian_pyramid(image, 4);
  for (int level = 0; level < 4; ++level) {
    const std::vector<std::uint32_t> histogram = lbp_histogram(levels[level], op.circle);
    for (int k = 0; k < 18; ++k) {
      EXPECT_NEAR(feature[18 * level + k], std::sqrt(std::ldexp(histogram[k], level) / all), 1e-6);
    }
  }
}

TEST(TextureFeature, AQuarterTurnChangesNothingWhereThePyramidHasAMiddle) {
  const cv::Mat image = random_image(193, 193, 7);  // 193, 97, 49, 25: every level begins and ends on a pixel
  for (const TextureOperator op : {TextureOperator{}, TextureOperator{{8, 1.0}, 4}, TextureOperator{{24, 3.0}, 3}}) {
    cv::Mat turned;
    cv::rotate(image, turned, cv::ROTATE_90_CLOCKWISE);
    EXPECT_EQ(texture_feature(image, op), texture_feature(turned, op));
  }
}

TEST(TextureFeature, TheLeastSideIsTheLeast) {
  for (const TextureOperator op :
       {TextureOperator{}, TextureOperator{{8, 1.0}, 4}, TextureOperator{{24, 3.0}, 2}, TextureOperator{{8, 1.5}, 1}}) {
    const int side = least_side(op);
    EXPECT_EQ(texture_feature(random_image(side, side, 2), op).size(), feature_size(op));
    EXPECT_THAT(message_of([&] { texture_feature(random_image(side, side - 1, 2), op); }),
                HasSubstr(fmt::format("at least {} x {}", side, side)));
  }
  EXPECT_EQ(least_side({}), 33);
}

TEST(HeightGray, BrighterIsHigherAndTheMedianIsInTheMiddle) {
  const cv::Mat heights = (cv::Mat_<float>(1, 5) << 0.500F, 0.504F, 0.496F, 2.0F, -3.0F);
  const cv::Mat gray = height_gray(heights, 0.002);
  EXPECT_EQ(cv::countNonZero(gray != (cv::Mat_<std::uint8_t>(1, 5) << 128, 130, 126, 255, 0)), 0);
}

TEST(HeightGray, OneOutlierMovesNoOtherLevel) {
  cv::Mat heights(50, 50, CV_32FC1);
  RandomStream random(3, 0, Purpose::kTest);
  for (int j = 0; j < 50; ++j) {
    for (int i = 0; i < 50; ++i) heights.at<float>(j, i) = static_cast<float>(0.02 * random.normal());
  }
  const cv::Mat before = height_gray(heights, 0.002);
  const float highest = 10.0F;
  heights.at<float>(7, 9) = heights.at<float>(7, 9) > 0.0F ? highest : -highest;
  EXPECT_EQ(cv::countNonZero(before != height_gray(heights, 0.002)), 1);
}

TEST(HeightGray, NoiseBelowHalfAStepIsFlat) {
  cv::Mat heights(60, 60, CV_32FC1, cv::Scalar(0.3));
  RandomStream random(4, 0, Purpose::kTest);
  for (int j = 0; j < 60; ++j) {
    for (int i = 0; i < 60; ++i) heights.at<float>(j, i) += static_cast<float>(0.0018 * (random.uniform() - 0.5));
  }
  EXPECT_EQ(lbp_histogram(height_gray(heights, 0.004), {16, 2.0})[16], 56U * 56U);
  EXPECT_LT(lbp_histogram(height_gray(heights, 0.0001), {16, 2.0})[16], 56U * 56U / 4);  // its local minima only
}

TEST(HeightGray, RefusesBadInput) {
  cv::Mat heights(4, 4, CV_32FC1, cv::Scalar(0));
  EXPECT_THAT(message_of([] { height_gray({}, 0.002); }), HasSubstr("empty"));
  EXPECT_THAT(message_of([] { height_gray(cv::Mat(4, 4, CV_64FC1), 0.002); }), HasSubstr("32 bit floats"));
  EXPECT_THAT(message_of([] { height_gray(cv::Mat(4, 4, CV_32FC3), 0.002); }), HasSubstr("3 channels"));
  EXPECT_THAT(message_of([&] { height_gray(heights, 0.0); }), HasSubstr("must be above 0"));
  heights.at<float>(2, 3) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(message_of([&] { height_gray(heights, 0.002); }), HasSubstr("column 3, row 2 is nan"));
  heights.at<float>(2, 3) = std::numeric_limits<float>::infinity();
  EXPECT_THAT(message_of([&] { height_gray(heights, 0.002); }), HasSubstr("column 3, row 2 is inf"));
}

}  // namespace
}  // namespace touchstone::sensors
