#include "lab/gelsight/gelsight_height_experiment.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <opencv2/core.hpp>

#include "core/units.h"

namespace touchstone::lab {
namespace {

TEST(WaveAmplitude, IsFoundBesideASlopeAndWithGaps) {
  cv::Mat heights(60, 90, CV_32FC1);
  for (int v = 0; v < 60; ++v) {
    for (int u = 0; u < 90; ++u) {
      const double wave = 0.004 * std::cos(2.0 * kPi * u / 7.3 + 0.8);
      heights.at<float>(v, u) = static_cast<float>(wave + 0.2 + 0.01 * u - 0.02 * v + 1e-4 * u * v);
    }
  }
  heights.at<float>(30, 40) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_NEAR(wave_amplitude(heights, {10, 10, 60, 40}, 7.3), 0.004, 1e-6);
  EXPECT_LT(wave_amplitude(heights, {10, 10, 60, 40}, 3.1), 2e-4);
}

TEST(HeightError, CountsWhereMembraneIsSeenOnly) {
  sim::Touch touch;
  touch.height = cv::Mat::zeros(4, 5, CV_32FC1);
  touch.contact = cv::Mat::zeros(4, 5, CV_8UC1);
  touch.height.at<float>(0, 0) = std::numeric_limits<float>::quiet_NaN();
  touch.height.at<float>(2, 2) = 0.5F;
  touch.contact.at<unsigned char>(2, 2) = 255;
  sensors::HeightResult estimate;
  estimate.height_mm = cv::Mat::zeros(4, 5, CV_32FC1);
  estimate.contact = cv::Mat::zeros(4, 5, CV_8UC1);
  estimate.height_mm.at<float>(2, 2) = 0.519F;
  estimate.contact.at<unsigned char>(2, 2) = 255;
  estimate.contact.at<unsigned char>(2, 3) = 255;
  const HeightError error = height_error(estimate, touch, 0.05);
  EXPECT_NEAR(error.mean_um, 19.0 / 19.0, 1e-3);
  EXPECT_NEAR(error.worst_um, 19.0, 1e-3);
  EXPECT_NEAR(error.depth_error_um, 19.0, 1e-3);
  EXPECT_NEAR(error.deepest_mm, 0.5, 1e-6);
  EXPECT_DOUBLE_EQ(error.contact_overlap, 0.5);
}

}  // namespace
}  // namespace touchstone::lab
