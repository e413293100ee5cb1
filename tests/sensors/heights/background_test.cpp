#include "sensors/heights/background.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/sensors/heights/painted_gel.h"

namespace touchstone::sensors {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

TEST(Background, NoiseIsThatOfOneFrame) {
  fixtures::GelPainter painter(80, 60, 0.05, {.noise_DN = 2.0});
  const Background background = painter.background(20);
  ASSERT_TRUE(background.noise_DN);
  // Rounding to whole numbers adds 1/12 to the variance.
  for (int c = 0; c < 3; ++c) EXPECT_NEAR((*background.noise_DN)[c], std::sqrt(4.0 + 1.0 / 12.0), 0.02);
  EXPECT_EQ(background.frames, 20);
  EXPECT_FALSE(mean_background(std::vector{painter.rest()}).noise_DN);
}

TEST(Background, DifferenceHasASign) {
  const cv::Mat dark(4, 5, CV_8UC3, cv::Scalar(10, 20, 30));
  const cv::Mat mixed(4, 5, CV_8UC3, cv::Scalar(0, 25, 30));
  const cv::Mat difference = difference_to(mean_background(std::vector{dark}), mixed);
  EXPECT_EQ(difference.at<cv::Vec3f>(2, 3), cv::Vec3f(-10.0F, 5.0F, 0.0F));
}

TEST(Background, UnfitFramesAreNamed) {
  const cv::Mat good(4, 5, CV_8UC3, cv::Scalar(10, 20, 30));
  const cv::Mat bright(4, 5, CV_8UC3, cv::Scalar(10, 255, 30));
  const auto mean = [](std::vector<cv::Mat> frames) { return [frames] { mean_background(frames); }; };
  EXPECT_THAT(mean({}), ThrowsMessage<Error>(HasSubstr("no background")));
  EXPECT_THAT(mean({good, cv::Mat(4, 5, CV_8UC1)}), ThrowsMessage<Error>(HasSubstr("background frame 2: is grey")));
  EXPECT_THAT(mean({cv::Mat(4, 5, CV_8UC4)}), ThrowsMessage<Error>(HasSubstr("has 4 channels")));
  EXPECT_THAT(mean({cv::Mat(4, 5, CV_16UC3)}), ThrowsMessage<Error>(HasSubstr("8 bits")));
  EXPECT_THAT(mean({good, cv::Mat(5, 5, CV_8UC3)}),
              ThrowsMessage<Error>(HasSubstr("5 x 5 px; the background is 5 x 4")));
  EXPECT_THAT(mean({cv::Mat()}), ThrowsMessage<Error>(HasSubstr("is empty")));
  EXPECT_THAT(mean({bright}), ThrowsMessage<Error>(HasSubstr("100.0 % of its pixels are saturated")));
}

}  // namespace
}  // namespace touchstone::sensors
