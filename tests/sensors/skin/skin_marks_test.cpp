#include "sensors/skin/skin_marks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "tests/support/message_of.h"

namespace touchstone::sensors {
namespace {

using ::testing::HasSubstr;
using touchstone::test::message_of;

constexpr int kWidth = 320;
constexpr int kHeight = 240;
const cv::Scalar kSkin(60, 75, 120);   // B G R
const cv::Scalar kRed(50, 52, 128);    // 14 units more than the skin
const cv::Scalar kPurple(35, 28, 66);  // 17 units more
const cv::Point kLeft(90, 120), kRight(230, 120);

/// A frame of skin with two marks, unevenly lit, with noise and beads.
cv::Mat frame(const cv::Scalar& left, const cv::Scalar& right, double brightness, int seed) {
  cv::Mat picture(kHeight, kWidth, CV_32FC3, kSkin);
  cv::circle(picture, kLeft, 35, left, cv::FILLED);
  cv::circle(picture, kRight, 35, right, cv::FILLED);
  for (int k = 0; k < 3; ++k) cv::circle(picture, {160, 60 + 60 * k}, 8, cv::Scalar(5, 5, 5), cv::FILLED);
  for (int row = 0; row < kHeight; ++row) {
    for (int column = 0; column < kWidth; ++column) {
      const double fall = 1.0 - 0.4 * cv::norm(cv::Point(column, row) - cv::Point(160, 120)) / 200.0;
      picture.at<cv::Vec3f>(row, column) *= static_cast<float>(brightness * fall);
    }
  }
  cv::GaussianBlur(picture, picture, {}, 3.0);
  cv::Mat noise(picture.size(), CV_32FC3);
  cv::RNG random(static_cast<std::uint64_t>(seed));
  random.fill(noise, cv::RNG::NORMAL, 0.0, 4.0);
  picture += noise;
  cv::Mat bytes;
  picture.convertTo(bytes, CV_8U);
  return bytes;
}

TEST(SkinMarks, WhatFadesIsErythemaAndWhatStaysIsPurpura) {
  for (int seed = 1; seed <= 5; ++seed) {
    // Under pressure all is darker, as a wetted skin is.
    const std::vector<SkinMark> marks =
        skin_marks(frame(kRed, kPurple, 1.0, seed), frame(kSkin, kPurple, 0.7, seed + 100));
    ASSERT_EQ(marks.size(), 2u);
    const SkinMark& left = marks[marks[0].centre.x() < 160 ? 0 : 1];
    const SkinMark& right = marks[marks[0].centre.x() < 160 ? 1 : 0];
    EXPECT_EQ(left.kind, SkinMarkKind::erythema);
    EXPECT_EQ(right.kind, SkinMarkKind::purpura);
    EXPECT_NEAR((left.centre - Eigen::Vector2d(90.5, 120.5)).norm(), 0.0, 1.5);
    // Blurred by 3 and 4 px, the rim comes to least_index, 3 of its 14, some 0.8 * 5 px outside.
    EXPECT_NEAR(left.area_px, 3.1416 * 39 * 39, 300.0);
    // 100 log10(R/G) of the mark less that of the skin.
    EXPECT_NEAR(left.index_before, 100 * std::log10(128.0 / 52 / (120.0 / 75)), 1.0);
    EXPECT_NEAR(right.index_before, 100 * std::log10(66.0 / 28 / (120.0 / 75)), 1.0);
    EXPECT_NEAR(left.blanched, 1.0, 0.1);
    EXPECT_NEAR(right.blanched, 0.0, 0.1);
  }
}

TEST(SkinMarks, BrightnessAndColourOfTheLightChangeNoIndex) {
  const cv::Mat before = frame(kRed, kPurple, 1.0, 3);
  const cv::Mat pressed = frame(kSkin, kPurple, 0.7, 4);
  const auto tinted = [](const cv::Mat& picture) {
    cv::Mat out;
    cv::multiply(picture, cv::Scalar(0.8, 0.9, 1.3), out);
    return out;
  };
  const auto plain = skin_marks(before, pressed);
  const auto warm = skin_marks(tinted(before), tinted(pressed));
  ASSERT_EQ(plain.size(), warm.size());
  for (std::size_t k = 0; k < plain.size(); ++k) {
    EXPECT_EQ(plain[k].kind, warm[k].kind);
    EXPECT_NEAR(plain[k].index_before, warm[k].index_before, 0.6);
  }
}

TEST(SkinMarks, AnEvenSkinHasNone) {
  EXPECT_TRUE(skin_marks(frame(kSkin, kSkin, 1.0, 1), frame(kSkin, kSkin, 0.7, 2)).empty());
  const cv::Mat constant(kHeight, kWidth, CV_8UC3, kSkin);
  EXPECT_TRUE(skin_marks(constant, constant).empty());
}

TEST(SkinMarks, AMarkThatTheSecondFrameHidesIsUnknown) {
  cv::Mat hidden = frame(kSkin, kPurple, 0.7, 2);
  cv::circle(hidden, kRight, 60, cv::Scalar(255, 255, 255), cv::FILLED);
  const std::vector<SkinMark> marks = skin_marks(frame(kRed, kPurple, 1.0, 1), hidden);
  ASSERT_EQ(marks.size(), 2u);
  for (const SkinMark& mark : marks) {
    EXPECT_EQ(mark.kind, mark.centre.x() < 160 ? SkinMarkKind::erythema : SkinMarkKind::unknown);
  }
}

// Where the gel doesn't wet the skin it isn't darker, and nothing presses blood out: that it stays red tells nothing.
TEST(SkinMarks, AMarkBesideTheContactIsUnknown) {
  const cv::Mat before = frame(kRed, kPurple, 1.0, 1);
  const cv::Mat beside = frame(kRed, kPurple, 1.0, 2);
  for (const SkinMark& mark : skin_marks(before, beside)) {
    EXPECT_EQ(mark.kind, SkinMarkKind::unknown);
    EXPECT_NEAR(mark.darkened, 1.0, 0.02);
    EXPECT_NEAR(mark.blanched, 0.0, 0.1);
  }
  SkinMarkSettings wetted_before;
  wetted_before.wetted_part = 0.0;
  const std::vector<SkinMark> marks = skin_marks(before, beside, wetted_before);
  ASSERT_EQ(marks.size(), 2u);
  for (const SkinMark& mark : marks) EXPECT_EQ(mark.kind, SkinMarkKind::purpura);
}

TEST(SkinMarks, FramesAndSettingsThatMakeNoSenseAreRefused) {
  const cv::Mat good = frame(kRed, kPurple, 1.0, 1);
  const auto error = [&](const cv::Mat& before, const cv::Mat& pressed, SkinMarkSettings settings = {}) {
    return message_of([&] { skin_marks(before, pressed, settings); });
  };
  EXPECT_THAT(error(cv::Mat(), good), HasSubstr("three bytes a pixel"));
  EXPECT_THAT(error(good, cv::Mat(kHeight, kWidth, CV_8UC1, cv::Scalar(80))), HasSubstr("three bytes a pixel"));
  EXPECT_THAT(error(good, good(cv::Rect(0, 0, 100, 100)).clone()), HasSubstr("both must be of one size"));
  const cv::Mat black(kHeight, kWidth, CV_8UC3, cv::Scalar::all(0));
  const cv::Mat white(kHeight, kWidth, CV_8UC3, cv::Scalar::all(255));
  EXPECT_THAT(error(black, good), HasSubstr("0 % of the frame before pressure"));
  EXPECT_THAT(error(good, white), HasSubstr("0 % of the frame under pressure"));
  SkinMarkSettings settings;
  settings.blanched_share = 0.0;
  EXPECT_THAT(error(good, good, settings), HasSubstr("blanched_share is 0"));
}

}  // namespace
}  // namespace touchstone::sensors
