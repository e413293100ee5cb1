#include "sensors/heights/height_overlay.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "tests/support/message_of.h"

namespace touchstone::sensors {
namespace {

using ::testing::HasSubstr;

HeightResult disc() {
  HeightResult result;
  result.height_mm = cv::Mat(60, 80, CV_32F, cv::Scalar(0));
  result.contact = cv::Mat(60, 80, CV_8U, cv::Scalar(0));
  cv::circle(result.height_mm, {40, 40}, 10, cv::Scalar(0.5), cv::FILLED);
  cv::circle(result.contact, {40, 40}, 10, cv::Scalar(255), cv::FILLED);
  return result;
}

TEST(HeightOverlay, ShowsTheContactOnTheFrameAndTheHeightsBesideIt) {
  const cv::Mat frame(60, 80, CV_8UC3, cv::Scalar(90, 90, 90));
  HeightResult result = disc();
  cv::Mat picture;
  draw_overlay(frame, result, 1.0, picture);
  ASSERT_EQ(picture.size(), cv::Size(160, 60));
  ASSERT_EQ(picture.type(), CV_8UC3);
  EXPECT_EQ(picture.at<cv::Vec3b>(40, 40), cv::Vec3b(90, 90, 90)) << "within the contact the frame is seen";
  EXPECT_EQ(picture.at<cv::Vec3b>(40, 50), cv::Vec3b(60, 220, 60)) << "its rim, green";
  EXPECT_EQ(picture.at<cv::Vec3b>(40, 130), cv::Vec3b(60, 220, 60));
  EXPECT_NEAR(picture.at<cv::Vec3b>(40, 120)[1], 128, 1) << "0.5 mm of 1";
  EXPECT_EQ(picture.at<cv::Vec3b>(55, 90), cv::Vec3b(0, 0, 0));
  EXPECT_EQ(cv::norm(frame, cv::Mat(60, 80, CV_8UC3, cv::Scalar(90, 90, 90)), cv::NORM_INF), 0.0);
  result.overexposed = true;
  draw_overlay(frame, result, 1.0, picture);
  EXPECT_EQ(picture.at<cv::Vec3b>(40, 50), cv::Vec3b(40, 40, 230)) << "not to be trusted: red";
}

TEST(HeightOverlay, DrawsDarknessOfAGreyFrameTheSameWay) {
  const HeightResult same = disc();
  DarknessResult result;
  result.height_mm = same.height_mm;
  result.contact = same.contact;
  cv::Mat grey, colour;
  draw_overlay(cv::Mat(60, 80, CV_8UC1, cv::Scalar(90)), result, 1.0, grey);
  draw_overlay(cv::Mat(60, 80, CV_8UC3, cv::Scalar(90, 90, 90)), same, 1.0, colour);
  EXPECT_EQ(cv::norm(grey, colour, cv::NORM_INF), 0.0);
  result.dark = true;
  draw_overlay(cv::Mat(60, 80, CV_8UC1, cv::Scalar(90)), result, 1.0, grey);
  EXPECT_EQ(grey.at<cv::Vec3b>(40, 50), cv::Vec3b(40, 40, 230));
  EXPECT_THAT(test::message_of([&] { draw_overlay(cv::Mat(60, 80, CV_16UC1), result, 1.0, grey); }),
              HasSubstr("1 or 3 channels"));
}

TEST(HeightOverlay, RefusesWhatDoesntFit) {
  const HeightResult result = disc();
  cv::Mat picture;
  const auto refused = [&](const cv::Mat& frame, double highest_mm) {
    return test::message_of([&] { draw_overlay(frame, result, highest_mm, picture); });
  };
  EXPECT_THAT(refused(cv::Mat(60, 80, CV_8UC1), 1.0), HasSubstr("3 channels"));
  EXPECT_THAT(refused(cv::Mat(60, 70, CV_8UC3), 1.0), HasSubstr("of the heights' size"));
  EXPECT_THAT(refused(cv::Mat(60, 80, CV_8UC3), 0.0), HasSubstr("highest_mm is 0"));
}

}  // namespace
}  // namespace touchstone::sensors
