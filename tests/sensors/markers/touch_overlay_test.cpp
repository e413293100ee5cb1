#include "sensors/markers/touch_overlay.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "tests/support/message_of.h"

namespace touchstone::sensors {
namespace {

using ::testing::HasSubstr;

const cv::Vec3b kGrey(90, 90, 90);

cv::Mat grey() {
  return {100, 160, CV_8UC3, cv::Scalar(90, 90, 90)};
}

/// An ellipse of 20 x 10 px about (80.5, 50.5).
TouchReading touch_of(double normal_N) {
  TouchReading touch;
  touch.patch.emplace();
  touch.patch->centre = {80.5, 50.5};
  touch.patch->area_px = 628.0;
  touch.patch->edge = Eigen::Vector2d(1.0 / 400.0, 1.0 / 100.0).asDiagonal();
  touch.normal_N = normal_N;
  touch.trusted = true;
  touch.rim.state = SlipState::kSticking;
  return touch;
}

/// Height of the bar, px.
int bar_of(const cv::Mat& picture) {
  int rows = 0;
  for (int v = 0; v < picture.rows; ++v) rows += picture.at<cv::Vec3b>(v, 150) == cv::Vec3b(255, 170, 40) ? 1 : 0;
  return rows;
}

TEST(TouchOverlay, DrawsContactAndABarAsHighAsTheForce) {
  cv::Mat picture = grey();
  draw_touch(touch_of(1.0), picture, {.full_force_N = 2.0});
  EXPECT_NE(picture.at<cv::Vec3b>(50, 100), kGrey) << "the ellipse's end";
  EXPECT_NE(picture.at<cv::Vec3b>(40, 80), kGrey);
  EXPECT_EQ(picture.at<cv::Vec3b>(50, 80), kGrey) << "within it the frame is seen";
  EXPECT_NEAR(bar_of(picture), 44, 2) << "half of 88";
  cv::Mat full = grey();
  draw_touch(touch_of(9.0), full, {.full_force_N = 2.0});
  EXPECT_NEAR(bar_of(full), 88, 2);
}

TEST(TouchOverlay, WithoutForceThereIsNoBarAndWithoutContactNoEllipse) {
  TouchReading touch;
  cv::Mat picture = grey();
  draw_touch(touch, picture);
  EXPECT_EQ(bar_of(picture), 0);
  EXPECT_EQ(cv::norm(picture.rowRange(0, 80), grey().rowRange(0, 80), cv::NORM_INF), 0.0);
  EXPECT_GT(cv::norm(picture, grey(), cv::NORM_INF), 0.0) << "it says so";
}

TEST(TouchOverlay, RefusesWhatItCantDrawOn) {
  cv::Mat picture(10, 10, CV_8UC1);
  EXPECT_THAT(test::message_of([&] { draw_touch({}, picture); }), HasSubstr("3 channels"));
  picture = grey();
  EXPECT_THAT(test::message_of([&] { draw_touch({}, picture, {.full_force_N = 0.0}); }),
              HasSubstr("full_force_N is 0"));
}

}  // namespace
}  // namespace touchstone::sensors
