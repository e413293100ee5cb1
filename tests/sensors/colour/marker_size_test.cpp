#include "sensors/colour/marker_size.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/error.h"

namespace touchstone::sensors {
namespace {

TEST(MarkerSize, CountsThePixelsOfADarkSquare) {
  cv::Mat grey(40, 50, CV_8UC1, cv::Scalar(255));
  cv::rectangle(grey, cv::Rect(10, 12, 14, 9), cv::Scalar(0), cv::FILLED);
  EXPECT_EQ(marker_size(grey).pixels, 14 * 9);
  EXPECT_NEAR(marker_size(grey).darkness_px, 14 * 9, 1e-9);
  cv::Mat values;
  grey.convertTo(values, CV_32F, 1.0 / 255.0);
  EXPECT_EQ(marker_size(values).pixels, 14 * 9);
}

TEST(MarkerSize, APixelHalfCoveredCountsWhollyOrNotAtAllButHalfForTheDarkness) {
  cv::Mat grey(8, 8, CV_32FC1, cv::Scalar(1.0));
  grey.at<float>(3, 3) = 0.6F;
  EXPECT_EQ(marker_size(grey).pixels, 0);
  EXPECT_NEAR(marker_size(grey).darkness_px, 0.4, 1e-6);
  grey.at<float>(3, 3) = 0.4F;
  EXPECT_EQ(marker_size(grey).pixels, 1);
  EXPECT_EQ(marker_size(grey, 0.3).pixels, 0);
}

TEST(MarkerSize, RefusesWhatIsNotGreyOrNoThreshold) {
  const cv::Mat grey(8, 8, CV_8UC1, cv::Scalar(255));
  EXPECT_THROW(marker_size(cv::Mat()), Error);
  EXPECT_THROW(marker_size(cv::Mat(8, 8, CV_8UC3, cv::Scalar::all(255))), Error);
  EXPECT_THROW(marker_size(cv::Mat(8, 8, CV_16UC1, cv::Scalar::all(255))), Error);
  EXPECT_THROW(marker_size(grey, 0.0), Error);
  EXPECT_THROW(marker_size(grey, 1.0), Error);
}

}  // namespace
}  // namespace touchstone::sensors
