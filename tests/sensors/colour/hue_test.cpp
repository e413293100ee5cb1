#include "sensors/colour/hue.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace touchstone::sensors {
namespace {

constexpr double kPi = 3.14159265358979323846;

TEST(Hue, IsTheHexagonsHue) {
  for (int blue = 0; blue <= 255; blue += 15) {
    for (int green = 0; green <= 255; green += 17) {
      for (int red = 0; red <= 255; red += 51) {
        if (blue == green && green == red) continue;
        const cv::Mat pixel(1, 1, CV_32FC3, cv::Scalar(blue, green, red));
        cv::Mat hsv;
        cv::cvtColor(pixel, hsv, cv::COLOR_BGR2HSV);
        const double expected = hsv.at<cv::Vec3f>(0, 0)[0] * kPi / 180.0;
        const Eigen::Vector2d direction = hue_direction(blue, green, red);
        EXPECT_NEAR(hue_difference(hue_of(direction), expected), 0.0, 1e-5) << blue << " " << green << " " << red;
        EXPECT_NEAR(direction.norm(), 1.0, 1e-5);
      }
    }
  }
}

TEST(Hue, MeanAcrossRedIsRed) {
  const Eigen::Vector2d sum = hue_direction(30, 0, 200) + hue_direction(0, 30, 200);
  EXPECT_NEAR(hue_difference(hue_of(sum), 0.0), 0.0, 1e-6);
}

TEST(Hue, IsAtLeastZeroAndBelowTheWholeCircle) {
  EXPECT_EQ(hue_of({1.0, 0.0}), 0.0);
  const double least = hue_of({1.0, -1e-300});
  EXPECT_GE(least, 0.0);
  EXPECT_LT(least, 2.0 * kPi);
  EXPECT_NEAR(hue_of({0.0, -1.0}), 1.5 * kPi, 1e-12);
}

TEST(Hue, DifferenceGoesAlongTheShorterArc) {
  EXPECT_NEAR(hue_difference(0.1, 2.0 * kPi - 0.1), 0.2, 1e-12);
  EXPECT_NEAR(hue_difference(2.0 * kPi - 0.1, 0.1), -0.2, 1e-12);
  EXPECT_NEAR(hue_difference(2.0, 1.0), 1.0, 1e-12);
  EXPECT_EQ(hue_difference(kPi, 0.0), kPi);
  EXPECT_EQ(hue_difference(0.0, kPi), kPi);
}

}  // namespace
}  // namespace touchstone::sensors
