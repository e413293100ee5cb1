#include "sensors/texture/local_binary_pattern.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <limits>
#include <numeric>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "core/random.h"

namespace touchstone::sensors {
namespace {

using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;
using Histogram = std::vector<std::uint32_t>;

constexpr LbpCircle kSmall{4, 1.0};
constexpr LbpCircle kEight{8, 1.0};
constexpr LbpCircle kSixteen{16, 2.0};

cv::Mat random_image(int columns, int rows, int brightest, std::uint64_t seed) {
  RandomStream random(seed, 0, Purpose::kTest);
  cv::Mat image(rows, columns, CV_8UC1);
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      image.at<std::uint8_t>(j, i) = static_cast<std::uint8_t>(random.uniform() * (brightest + 1));
    }
  }
  return image;
}

std::uint32_t sum(const Histogram& histogram) {
  return std::accumulate(histogram.begin(), histogram.end(), 0U);
}

/// Eqs. 5 to 9 as they stand, for one pixel: no speed, no exactness.
int label_by_definition(const cv::Mat& gray, int column, int row, const LbpCircle& circle) {
  const int count = circle.neighbours;
  std::vector<int> bits;
  for (int p = 0; p < count; ++p) {
    const double angle = 2.0 * CV_PI * p / count;
    const double x = column + circle.radius_px * std::cos(angle);
    const double y = row + circle.radius_px * std::sin(angle);
    const int left = std::min(static_cast<int>(std::floor(x)), gray.cols - 2);
    const int top = std::min(static_cast<int>(std::floor(y)), gray.rows - 2);
    const double u = x - left, v = y - top;
    const auto at = [&](int i, int j) { return static_cast<double>(gray.at<std::uint8_t>(top + j, left + i)); };
    const double value = (1 - v) * ((1 - u) * at(0, 0) + u * at(1, 0)) + v * ((1 - u) * at(0, 1) + u * at(1, 1));
    bits.push_back(value - gray.at<std::uint8_t>(row, column) >= -1e-9 ? 1 : 0);
  }
  int changes = 0;
  for (int p = 0; p < count; ++p) changes += std::abs(bits[p] - bits[(p + count - 1) % count]);
  return changes <= 2 ? std::accumulate(bits.begin(), bits.end(), 0) : count + 1;
}

TEST(LocalBinaryPattern, HandMadeNeighbourhoods) {
  // The four neighbours of the middle pixel, in the order right, below, left, above.
  const auto label = [](int right, int below, int left, int above) {
    const cv::Mat image = (cv::Mat_<std::uint8_t>(3, 3) << 0, above, 0, left, 50, right, 0, below, 0);
    return static_cast<int>(lbp_labels(image, kSmall).at<std::uint8_t>(0, 0));
  };
  EXPECT_EQ(label(10, 10, 10, 10), 0);  // a spot
  EXPECT_EQ(label(60, 10, 10, 10), 1);
  EXPECT_EQ(label(60, 60, 10, 10), 2);  // an edge
  EXPECT_EQ(label(60, 10, 10, 60), 2);  // an edge across the first bit
  EXPECT_EQ(label(60, 60, 10, 60), 3);
  EXPECT_EQ(label(60, 60, 60, 60), 4);  // a pit
  EXPECT_EQ(label(60, 10, 60, 10), 5);  // four changes: not uniform
  EXPECT_EQ(label(50, 10, 10, 10), 1);  // equal counts as brighter [Li2015, eq. 6]
  EXPECT_EQ(label(50, 50, 50, 50), 4);  // flat
}

TEST(LocalBinaryPattern, NeighboursBetweenPixelsAreBilinear) {
  // P = 8, R = 1: the diagonal neighbour stands at 0.7071, where it weighs its corner 1/2, the two beside it
  // (1 - 0.7071) 0.7071 = 0.2071 each and the centre 0.0858.
  cv::Mat image(3, 3, CV_8UC1, cv::Scalar(100));
  const auto label = [&](int corner, int side) {
    image.at<std::uint8_t>(2, 2) = static_cast<std::uint8_t>(corner);
    image.at<std::uint8_t>(1, 2) = static_cast<std::uint8_t>(side);
    image.at<std::uint8_t>(2, 1) = static_cast<std::uint8_t>(side);
    return static_cast<int>(lbp_labels(image, kEight).at<std::uint8_t>(0, 0));
  };
  EXPECT_EQ(label(100, 100), 8);
  EXPECT_EQ(label(100 - 40, 100 + 50), 8);  // 20 below, 20.7 above: the diagonal neighbour is brighter
  EXPECT_EQ(label(100 - 42, 100 + 50), 7);  // 21 below: darker, one bit of eight is 0
  EXPECT_EQ(label(100, 99), 8 - 5);         // both sides dark: so are the three diagonals that they touch
}

TEST(LocalBinaryPattern, EqualsTheDefinition) {
  for (const LbpCircle circle : {kSmall, kEight, kSixteen, LbpCircle{24, 3.0}, LbpCircle{12, 2.5}, LbpCircle{7, 1.5}}) {
    SCOPED_TRACE(testing::Message() << circle.neighbours << ", " << circle.radius_px);
    const cv::Mat image = random_image(61, 47, 255, 3);
    const int margin = lbp_margin(circle);
    const cv::Mat labels = lbp_labels(image, circle);
    ASSERT_EQ(labels.cols, image.cols - 2 * margin);
    ASSERT_EQ(labels.rows, image.rows - 2 * margin);
    int different = 0;
    for (int j = 0; j < labels.rows; ++j) {
      for (int i = 0; i < labels.cols; ++i) {
        different += labels.at<std::uint8_t>(j, i) != label_by_definition(image, i + margin, j + margin, circle);
      }
    }
    // A neighbour is looked up to 1/256 px: by up to 1/512 px and half a level of 255 another brightness, which crosses
    // the centre's in at most some 0.2 % of all neighbours of white noise.
    EXPECT_LE(different, 0.002 * circle.neighbours * static_cast<double>(labels.total()));
  }
}

TEST(LocalBinaryPattern, EveryLabelOccursAndNoOther) {
  for (const LbpCircle circle : {kSmall, kEight, kSixteen, LbpCircle{24, 3.0}}) {
    // Smooth noise has spots, edges of all curvatures and pits.
    cv::Mat image = random_image(400, 400, 255, 5);
    cv::GaussianBlur(image, image, {}, 0.9 * circle.radius_px);
    cv::normalize(image, image, 0, 255, cv::NORM_MINMAX);
    const Histogram histogram = lbp_histogram(image, circle);
    ASSERT_EQ(histogram.size(), circle.neighbours + 2U);
    EXPECT_THAT(histogram, Each(testing::Gt(0U))) << circle.neighbours;
    const auto side = static_cast<std::uint32_t>(400 - 2 * lbp_margin(circle));
    EXPECT_EQ(sum(histogram), side * side);
  }
}

TEST(LocalBinaryPattern, FlatPartsHaveAllBits) {
  for (const int level : {0, 1, 77, 200, 255}) {
    const cv::Mat image(20, 20, CV_8UC1, cv::Scalar(level));
    EXPECT_EQ(lbp_histogram(image, kSixteen)[16], 16U * 16U);
    EXPECT_EQ(lbp_histogram(image, {24, 3.0})[24], 14U * 14U);
  }
}

TEST(LocalBinaryPattern, ARampIsAnEdge) {
  cv::Mat image(30, 30, CV_8UC1);
  for (int j = 0; j < image.rows; ++j) {
    for (int i = 0; i < image.cols; ++i) image.at<std::uint8_t>(j, i) = static_cast<std::uint8_t>(10 + 5 * i + 2 * j);
  }
  // No neighbour of 16 stands across the slope, so half are above.
  const Histogram histogram = lbp_histogram(image, kSixteen);
  EXPECT_EQ(histogram[8], 26U * 26U);
}

TEST(LocalBinaryPattern, ShiftedAndScaledBrightnessChangesNothing) {
  const cv::Mat image = random_image(64, 64, 60, 7);
  const cv::Mat brighter = image + cv::Scalar(31);
  const cv::Mat scaled = 4 * image + cv::Scalar(9);
  for (const LbpCircle circle : {kSmall, kEight, kSixteen, LbpCircle{24, 3.0}}) {
    EXPECT_EQ(lbp_histogram(image, circle), lbp_histogram(brighter, circle));
    EXPECT_EQ(lbp_histogram(image, circle), lbp_histogram(scaled, circle));
  }
}

TEST(LocalBinaryPattern, AnyIncreasingChangeOfBrightnessChangesNothingOnPixels) {
  const cv::Mat image = random_image(64, 64, 15, 9);
  cv::Mat squared(image.size(), CV_8UC1);
  for (int j = 0; j < image.rows; ++j) {
    for (int i = 0; i < image.cols; ++i) {
      const int level = image.at<std::uint8_t>(j, i);
      squared.at<std::uint8_t>(j, i) = static_cast<std::uint8_t>(level * level + 5);
    }
  }
  EXPECT_EQ(lbp_histogram(image, kSmall), lbp_histogram(squared, kSmall));
}

TEST(LocalBinaryPattern, QuarterTurnsAndMirrorsKeepTheHistogram) {
  const cv::Mat image = random_image(83, 60, 255, 11);
  for (const LbpCircle circle : {kSmall, kEight, kSixteen, LbpCircle{24, 3.0}, LbpCircle{12, 2.7}}) {
    const Histogram straight = lbp_histogram(image, circle);
    for (const auto turn : {cv::ROTATE_90_CLOCKWISE, cv::ROTATE_180, cv::ROTATE_90_COUNTERCLOCKWISE}) {
      cv::Mat turned;
      cv::rotate(image, turned, turn);
      EXPECT_EQ(lbp_histogram(turned, circle), straight) << circle.neighbours;
    }
    cv::Mat mirrored;
    cv::flip(image, mirrored, 1);
    EXPECT_EQ(lbp_histogram(mirrored, circle), straight) << circle.neighbours;
  }
}

TEST(LocalBinaryPattern, OtherTurnsKeepTheHistogramOfASmoothTexture) {
  // A sum of waves that can be computed at any angle: no interpolation of the picture is part of the test.
  struct Wave {
    double x, y, phase;
  };
  RandomStream random(13, 0, Purpose::kTest);
  std::vector<Wave> waves;
  for (int k = 0; k < 60; ++k) {
    const double angle = 2.0 * CV_PI * random.uniform(), length = 9.0 + 6.0 * random.uniform();
    waves.push_back({2.0 * CV_PI / length * std::cos(angle), 2.0 * CV_PI / length * std::sin(angle),
                     2.0 * CV_PI * random.uniform()});
  }
  const auto histogram = [&](double turn) {
    cv::Mat image(300, 300, CV_8UC1);
    for (int j = 0; j < image.rows; ++j) {
      for (int i = 0; i < image.cols; ++i) {
        const double x = (i - 149.5) * std::cos(turn) - (j - 149.5) * std::sin(turn);
        const double y = (i - 149.5) * std::sin(turn) + (j - 149.5) * std::cos(turn);
        double value = 0.0;
        for (const Wave& wave : waves) value += std::cos(wave.x * x + wave.y * y + wave.phase);
        image.at<std::uint8_t>(j, i) = cv::saturate_cast<std::uint8_t>(128.0 + 5.0 * value);
      }
    }
    return lbp_histogram(image, kSixteen);
  };
  const Histogram straight = histogram(0.0);
  for (const double degrees : {10.0, 30.0, 45.0, 77.0}) {
    const Histogram turned = histogram(degrees * CV_PI / 180.0);
    double moved = 0.0;
    for (std::size_t k = 0; k < turned.size(); ++k) {
      moved += 0.5 * std::abs(static_cast<double>(turned[k]) - static_cast<double>(straight[k])) / (296.0 * 296.0);
    }
    EXPECT_LT(moved, 0.04) << degrees;  // of all pixels
  }
}

TEST(LocalBinaryPattern, RefusesBadImagesAndCircles) {
  const auto message = [](const cv::Mat& image, LbpCircle circle) -> std::string {
    try {
      lbp_labels(image, circle);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  const cv::Mat good(20, 20, CV_8UC1, cv::Scalar(1));
  EXPECT_EQ(message(good, kSixteen), "");
  EXPECT_THAT(message({}, kSixteen), HasSubstr("empty"));
  EXPECT_THAT(message(cv::Mat(20, 20, CV_8UC3), kSixteen), HasSubstr("3 channels"));
  EXPECT_THAT(message(cv::Mat(20, 20, CV_32FC1), kSixteen), HasSubstr("8 bit"));
  EXPECT_THAT(message(good(cv::Rect(0, 0, 20, 4)), kSixteen), HasSubstr("20 x 4 px"));
  EXPECT_EQ(lbp_labels(good(cv::Rect(0, 0, 5, 5)), kSixteen).total(), 1U);
  EXPECT_THAT(message(good, {3, 1.0}), HasSubstr("3 neighbours"));
  EXPECT_THAT(message(good, {25, 1.0}), HasSubstr("from 4 to 24"));
  EXPECT_THAT(message(good, {8, 0.5}), HasSubstr("0.5 px"));
  EXPECT_THAT(message(good, {8, std::numeric_limits<double>::quiet_NaN()}), HasSubstr("radius"));
}

TEST(LocalBinaryPattern, APartOfAnImageIsReadAsItsOwnImage) {
  const cv::Mat image = random_image(90, 70, 255, 17);
  const cv::Mat part = image(cv::Rect(13, 9, 40, 30));
  EXPECT_EQ(lbp_histogram(part, kSixteen), lbp_histogram(part.clone(), kSixteen));
}

}  // namespace
}  // namespace touchstone::sensors
