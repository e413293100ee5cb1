#include "render/cameras/rolling_shutter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <opencv2/core.hpp>

#include "core/error.h"

namespace touchstone::render {
namespace {

/// A picture that is bright right of x (pixels), with pixels on the edge covered in part.
cv::Mat edge_at(double x, int width, int height) {
  cv::Mat image(height, width, CV_32FC1);
  for (int row = 0; row < height; ++row) {
    for (int column = 0; column < width; ++column) {
      image.at<float>(row, column) = static_cast<float>(std::clamp(column + 1.0 - x, 0.0, 1.0));
    }
  }
  return image;
}

/// Where the edge lies in a row: pixels left of it are dark.
double edge_of(const cv::Mat& image, int row) {
  return image.cols - cv::sum(image.row(row))[0];
}

TEST(RollingShutter, ExposureSharesIntegrateHatFunctions) {
  const std::vector<double> times = {0.0, 1.0, 3.0};
  EXPECT_EQ(exposure_shares(times, 0.0, 3.0), (std::vector<double>{0.5 / 3.0, 1.5 / 3.0, 1.0 / 3.0}));
  EXPECT_EQ(exposure_shares(times, 2.0, 2.0), (std::vector<double>{0.0, 0.5, 0.5}));
  EXPECT_EQ(exposure_shares(times, 1.0, 1.0), (std::vector<double>{0.0, 1.0, 0.0}));
  EXPECT_EQ(exposure_shares(times, 3.0, 3.0), (std::vector<double>{0.0, 0.0, 1.0}));
  EXPECT_EQ(exposure_shares({5.0}, 5.0, 5.0), std::vector<double>{1.0});
  for (double from = 0.0; from < 3.0; from += 0.17) {
    for (double to = from; to <= 3.0; to += 0.29) {
      const std::vector<double> shares = exposure_shares(times, from, to);
      EXPECT_NEAR(std::accumulate(shares.begin(), shares.end(), 0.0), 1.0, 1e-12);
      // Light that is the time itself has the middle as its mean.
      EXPECT_NEAR(shares[1] + 3.0 * shares[2], 0.5 * (from + to), 1e-12);
    }
  }
}

TEST(RollingShutter, SkewOfAMovingEdgeIsLineTimeTimesSpeed) {
  constexpr double kSpeed = 3000.0;      // pixels per second
  constexpr double kLineTime_s = 44e-6;  // 0.132 pixels a row
  constexpr int kRows = 60;
  std::vector<TimedIrradiance> instants;
  for (int i = 0; i <= 60; ++i) instants.push_back({i * 1e-4, edge_at(10.0 + kSpeed * i * 1e-4, 64, kRows)});
  for (double exposure : {0.0, 1e-3, 2.5e-3}) {
    for (double line_time : {kLineTime_s, -kLineTime_s, 0.0}) {
      const double start = line_time < 0.0 ? kRows * kLineTime_s : 1e-5;
      const cv::Mat image = rolling_exposure(instants, {start, exposure, line_time});
      for (int row = 0; row < kRows; ++row) {
        const double expected = 10.0 + kSpeed * (start + row * line_time + exposure / 2.0);
        EXPECT_NEAR(edge_of(image, row), expected, 1e-4);
      }
      EXPECT_NEAR((edge_of(image, kRows - 1) - edge_of(image, 0)) / (kRows - 1), line_time * kSpeed, 1e-5);
    }
  }
}

// A pixel that the edge passes within the exposure has the share of the time in which it was bright.
TEST(RollingShutter, MotionBlurIsALinearRampAsWideAsTheMotion) {
  std::vector<TimedIrradiance> instants;
  for (int i = 0; i <= 200; ++i) instants.push_back({i * 1e-4, edge_at(10.0 + 0.1 * i, 64, 1)});  // 20 px
  const cv::Mat image = rolling_exposure(instants, {0.0, 200e-4, 0.0});
  for (int column = 0; column < 64; ++column) {
    const double expected = std::clamp((column + 0.5 - 10.0) / 20.0, 0.0, 1.0);
    EXPECT_NEAR(image.at<float>(0, column), expected, 2e-3) << column;
  }
}

TEST(RollingShutter, WhatStandsStillIsUnchangedInAllBands) {
  cv::Mat still(7, 5, CV_32FC3);
  cv::randu(still, 0.0, 1.0);
  const cv::Mat image = rolling_exposure({{0.0, still}, {0.01, still}, {0.02, still}}, {0.001, 0.004, 1e-3});
  EXPECT_LE(cv::norm(image, still, cv::NORM_INF), 1e-7);
}

TEST(RollingShutter, BadInputIsRefused) {
  const cv::Mat one(4, 4, CV_32FC1, cv::Scalar(1.0));
  const cv::Mat wide(4, 5, CV_32FC1, cv::Scalar(1.0));
  const cv::Mat bytes(4, 4, CV_8UC1, cv::Scalar(1));
  EXPECT_THROW(rolling_exposure({}, {}), Error);
  EXPECT_THROW(rolling_exposure({{0.0, one}, {1.0, wide}}, {}), Error);
  EXPECT_THROW(rolling_exposure({{0.0, bytes}}, {}), Error);
  EXPECT_THROW(rolling_exposure({{0.0, one}, {0.0, one}}, {}), Error);
  EXPECT_THROW(rolling_exposure({{0.0, one}, {1.0, one}}, {0.5, -0.1, 0.0}), Error);
  EXPECT_THROW(rolling_exposure({{0.0, one}, {1.0, one}}, {0.5, 0.6, 0.0}), Error);   // ends too late
  EXPECT_THROW(rolling_exposure({{0.0, one}, {1.0, one}}, {0.0, 0.5, 0.2}), Error);   // the last row does
  EXPECT_THROW(rolling_exposure({{0.0, one}, {1.0, one}}, {0.1, 0.5, -0.2}), Error);  // the last row begins too early
  EXPECT_NO_THROW(rolling_exposure({{0.0, one}, {1.0, one}}, {0.0, 0.4, 0.2}));       // to the very end
  EXPECT_THROW(rolling_exposure({{0.0, one}}, {std::nan(""), 0.0, 0.0}), Error);
}

}  // namespace
}  // namespace touchstone::render
