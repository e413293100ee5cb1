#include "sensors/heights/frame_gain.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "tests/sensors/heights/painted_gel.h"

namespace touchstone::sensors {
namespace {

class FrameGainTest : public ::testing::Test {
 protected:
  fixtures::GelPainter painter_{200, 160, 0.053, {.fall_off = 0.3}};
  Background background_ = painter_.background();
  GainFinder finder_{background_};
};

TEST_F(FrameGainTest, RestHasOne) {
  const FrameGain found = finder_.find(painter_.rest());
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(found.gain[c], 1.0, 0.003);
  EXPECT_GT(found.alike, 0.98);
}

TEST_F(FrameGainTest, IsFoundBesideAContact) {
  const cv::Mat press = painter_.press({{5.0, 4.0}, 1.5, 1.0}).frame;
  const FrameGain plain = finder_.find(press);
  const cv::Scalar factors(1.15, 0.85, 0.95);
  cv::Mat other;
  cv::multiply(press, factors, other);
  const FrameGain found = finder_.find(other);
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(plain.gain[c], 1.0, 0.01);
    EXPECT_NEAR(found.gain[c] / plain.gain[c], factors[c], 0.004);
  }
  EXPECT_NEAR(found.alike, plain.alike, 0.02);
  EXPECT_GT(found.alike, 0.5);
}

TEST_F(FrameGainTest, BrightPixelsThatAreCutOffDontCount) {
  // The brightest side of the picture is cut off; the gain is the other side's.
  fixtures::GelPainter bright(200, 160, 0.053, {.fall_off = 0.35, .level = 1.25});
  GainFinder finder(bright.background());
  cv::Mat other;
  cv::multiply(bright.rest(), cv::Scalar(1.2, 1.2, 1.2), other);
  const FrameGain found = finder.find(other);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(found.gain[c], 1.2, 0.006);
}

TEST_F(FrameGainTest, AnotherPictureIsntAlike) {
  cv::Mat turned;
  cv::flip(painter_.rest(), turned, -1);
  EXPECT_LT(finder_.find(turned).alike, 0.4);
  EXPECT_LT(finder_.find(cv::Mat(160, 200, CV_8UC3, cv::Scalar(90, 200, 30))).alike, 0.4);
}

TEST_F(FrameGainTest, BlackAndWhiteFramesHaveGainOne) {
  for (const double level : {0.0, 255.0}) {
    const FrameGain found = finder_.find(cv::Mat(160, 200, CV_8UC3, cv::Scalar::all(level)));
    EXPECT_EQ(found.gain, cv::Vec3d(1.0, 1.0, 1.0));
  }
}

}  // namespace
}  // namespace touchstone::sensors
