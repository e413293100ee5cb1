#include "sensors/skin/skin_marks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "tests/sensors/skin/painted_skin.h"
#include "tests/support/message_of.h"

namespace touchstone::sensors {
namespace {

using namespace fixtures;
using ::testing::HasSubstr;
using touchstone::test::message_of;

TEST(SkinMarks, WhatFadesIsErythemaAndWhatStaysIsPurpura) {
  for (int seed = 1; seed <= 5; ++seed) {
    // Under pressure all is darker, as a wetted skin is.
    const std::vector<SkinMark> marks =
        skin_marks(skin_frame(kRedMark, kPurpleMark, 1.0, seed), skin_frame(kEvenSkin, kPurpleMark, 0.7, seed + 100));
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
  const cv::Mat before = skin_frame(kRedMark, kPurpleMark, 1.0, 3);
  const cv::Mat pressed = skin_frame(kEvenSkin, kPurpleMark, 0.7, 4);
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
  EXPECT_TRUE(skin_marks(skin_frame(kEvenSkin, kEvenSkin, 1.0, 1), skin_frame(kEvenSkin, kEvenSkin, 0.7, 2)).empty());
  const cv::Mat constant(kSkinHeight, kSkinWidth, CV_8UC3, kEvenSkin);
  EXPECT_TRUE(skin_marks(constant, constant).empty());
}

TEST(SkinMarks, AMarkThatTheSecondFrameHidesIsUnknown) {
  cv::Mat hidden = skin_frame(kEvenSkin, kPurpleMark, 0.7, 2);
  cv::circle(hidden, kRightMark, 60, cv::Scalar(255, 255, 255), cv::FILLED);
  const std::vector<SkinMark> marks = skin_marks(skin_frame(kRedMark, kPurpleMark, 1.0, 1), hidden);
  ASSERT_EQ(marks.size(), 2u);
  for (const SkinMark& mark : marks) {
    EXPECT_EQ(mark.kind, mark.centre.x() < 160 ? SkinMarkKind::erythema : SkinMarkKind::unknown);
  }
}

// Where the gel doesn't wet the skin it isn't darker, and nothing presses blood out: that it stays red tells nothing.
TEST(SkinMarks, AMarkBesideTheContactIsUnknown) {
  const cv::Mat before = skin_frame(kRedMark, kPurpleMark, 1.0, 1);
  const cv::Mat beside = skin_frame(kRedMark, kPurpleMark, 1.0, 2);
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
  const cv::Mat good = skin_frame(kRedMark, kPurpleMark, 1.0, 1);
  const auto error = [&](const cv::Mat& before, const cv::Mat& pressed, SkinMarkSettings settings = {}) {
    return message_of([&] { skin_marks(before, pressed, settings); });
  };
  EXPECT_THAT(error(cv::Mat(), good), HasSubstr("three bytes a pixel"));
  EXPECT_THAT(error(good, cv::Mat(kSkinHeight, kSkinWidth, CV_8UC1, cv::Scalar(80))), HasSubstr("three bytes a pixel"));
  EXPECT_THAT(error(good, good(cv::Rect(0, 0, 100, 100)).clone()), HasSubstr("both must be of one size"));
  const cv::Mat black(kSkinHeight, kSkinWidth, CV_8UC3, cv::Scalar::all(0));
  const cv::Mat white(kSkinHeight, kSkinWidth, CV_8UC3, cv::Scalar::all(255));
  EXPECT_THAT(error(black, good), HasSubstr("0 % of the frame before pressure"));
  EXPECT_THAT(error(good, white), HasSubstr("0 % of the frame under pressure"));
  SkinMarkSettings settings;
  settings.blanched_share = 0.0;
  EXPECT_THAT(error(good, good, settings), HasSubstr("blanched_share is 0"));
}

}  // namespace
}  // namespace touchstone::sensors
