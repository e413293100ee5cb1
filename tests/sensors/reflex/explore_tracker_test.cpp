#include "sensors/reflex/explore_tracker.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/error.h"
#include "tests/sensors/reflex/painted_fingertip.h"

namespace touchstone::sensors {
namespace {

using fixtures::dilation_of;
using fixtures::FingertipPainter;
using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr double kDistance_mm = 16.0;
constexpr std::uint64_t kRest = 10000;  // the index of its noise

double press_of(const ExploreReading& reading) {
  return kDistance_mm * (1.0 - 1.0 / reading.motion.dilation);
}

struct Score {
  double worst_mm = 0.0, squares = 0.0, worst_at_rest_mm = 0.0;
  int frames = 0, absolute = 0, relative = 0, held = 0;

  double rms_mm() const { return std::sqrt(squares / frames); }
};

/// Twice 0 to 5 mm and back in steps of 0.2 mm, sideways a tenth of it, the light growing by 6 % a mm.
Score reciprocate(const ExploreSettings& settings, FingertipPainter painter) {
  ExploreTracker tracker(painter.paint(DotsMotion{}, kRest), settings);
  Score score;
  for (int i = 0; i <= 100; ++i) {
    const double press_mm = 0.2 * std::min(i % 50, 50 - i % 50);
    painter.gain = 1.0 + 0.06 * press_mm;
    const cv::Mat picture = painter.paint(DotsMotion{dilation_of(press_mm), {0.1 * press_mm, -0.05 * press_mm}},
                                          static_cast<std::uint64_t>(i));
    const ExploreReading& reading = tracker.next({picture, i * 216000});
    const double error_mm = std::abs(press_of(reading) - press_mm);
    score.worst_mm = std::max(score.worst_mm, error_mm);
    score.squares += error_mm * error_mm;
    ++score.frames;
    if (i % 50 == 0) score.worst_at_rest_mm = std::max(score.worst_at_rest_mm, error_mm);
    score.absolute += reading.mode == ExploreMode::absolute ? 1 : 0;
    score.relative += reading.mode == ExploreMode::relative ? 1 : 0;
    score.held += reading.mode == ExploreMode::held ? 1 : 0;
  }
  return score;
}

TEST(ExploreTracker, FollowsAReciprocationWithoutDrift) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    for (const ExploreSettings& settings : {ExploreSettings{}, text_explore_settings()}) {
      const Score score = reciprocate(settings, {.noise = 0.6, .seed = seed});
      EXPECT_LT(score.rms_mm(), 0.12) << seed;  // [Knoop2013]: 0.39
      EXPECT_LT(score.worst_mm, 0.4) << seed;   // [Knoop2013]: 0.80
      EXPECT_LT(score.worst_at_rest_mm, 0.1) << seed;
      EXPECT_EQ(score.held, 0);
    }
  }
}

/// The dots' plane is torn: a part of the picture moves otherwise, more so the deeper. Absolute correlation falls.
cv::Mat torn(const FingertipPainter& painter, const DotsMotion& motion, std::uint64_t index) {
  cv::Mat picture = painter.paint(motion, index);
  const cv::Mat other = painter.paint(
      DotsMotion{motion.dilation, motion.shift_px + Eigen::Vector2d(0.0, 10.0 * (motion.dilation - 1.0))}, index);
  other.colRange(13, 18).copyTo(picture.colRange(13, 18));
  return picture;
}

TEST(ExploreTracker, SwitchesToStepsAndBack) {
  // Where the pictures at depth aren't the ones at rest any more, steps go on, and at rest the absolute estimate takes
  // over again: what the steps have added up goes.
  const FingertipPainter painter{.noise = 0.6};
  ExploreTracker tracker(painter.paint(DotsMotion{}, kRest), {});
  int relative = 0;
  bool absolute_after_relative = false;
  for (int i = 0; i <= 50; ++i) {
    const double press_mm = 0.2 * std::min(i, 50 - i);
    const ExploreReading& reading =
        tracker.next({torn(painter, {dilation_of(press_mm), {0.0, 0.0}}, static_cast<std::uint64_t>(i)), i * 216000});
    ASSERT_NE(reading.mode, ExploreMode::held) << i;
    if (reading.mode == ExploreMode::relative) {
      ++relative;
      EXPECT_LT(reading.correlation, 0.95);
      EXPECT_GT(reading.step_correlation, 0.8);
    } else {
      absolute_after_relative = relative > 0;
    }
    EXPECT_NEAR(press_of(reading), press_mm, 1.0);
  }
  EXPECT_GT(relative, 10);
  EXPECT_TRUE(absolute_after_relative);
  EXPECT_NEAR(press_of(tracker.last()), 0.0, 0.1);
}

TEST(ExploreTracker, KeyPicturesDriftLessThanStepsFromPictureToPicture) {
  ExploreSettings keys;
  keys.absolute_from = 1.0;  // never: steps alone
  keys.search_reach_px = 0.0;
  ExploreSettings steps = keys;
  steps.key_correlation = 2.0;
  double with_keys = 0.0, without = 0.0;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const Score a = reciprocate(keys, {.noise = 0.6, .seed = seed});
    const Score b = reciprocate(steps, {.noise = 0.6, .seed = seed});
    EXPECT_EQ(a.relative, a.frames);
    with_keys += a.squares;
    without += b.squares;
  }
  EXPECT_LT(std::sqrt(with_keys / 303), 0.5);
  EXPECT_GT(without, 4.0 * with_keys);
}

TEST(ExploreTracker, BadPicturesAreSaidAndHeldAndForgotten) {
  const FingertipPainter painter{.noise = 0.6};
  FingertipPainter bare = painter;
  bare.ground = bare.dot;
  const cv::Mat rest = painter.paint(DotsMotion{}, kRest);
  cv::Mat mostly_white(18, 18, CV_8UC1, cv::Scalar(63));
  mostly_white.row(0).setTo(10);
  const std::vector<std::pair<cv::Mat, PictureFault>> cases = {
      {cv::Mat::zeros(18, 18, CV_8UC1), PictureFault::dark},
      {cv::Mat(18, 18, CV_8UC1, cv::Scalar(63)), PictureFault::saturated},
      {mostly_white, PictureFault::saturated},
      {cv::Mat(18, 18, CV_8UC1, cv::Scalar(30)), PictureFault::flat},
      {bare.paint(DotsMotion{}), PictureFault::no_dots},
      {painter.paint(DotsMotion{})(cv::Rect(0, 0, 17, 18)), PictureFault::foreign},
      {cv::Mat(18, 18, CV_8UC3, cv::Scalar(30, 30, 30)), PictureFault::foreign},
      {cv::Mat(), PictureFault::foreign}};
  for (const auto& [picture, fault] : cases) {
    ExploreTracker tracker(rest, {});
    const DotsMotion motion{1.05, {0.2, 0.1}};
    const DotsMotion before = tracker.next({painter.paint(motion), 0}).motion;
    for (int i = 1; i < 4; ++i) {
      const ExploreReading& reading = tracker.next({picture, i});
      EXPECT_EQ(reading.fault, fault) << name_of(fault);
      EXPECT_EQ(reading.mode, ExploreMode::held);
      EXPECT_EQ(reading.motion, before);
    }
    const ExploreReading& after = tracker.next({painter.paint(motion, 5), 5});
    EXPECT_EQ(after.fault, PictureFault::none);
    EXPECT_EQ(after.mode, ExploreMode::absolute) << name_of(fault);
    EXPECT_NEAR(after.motion.dilation, motion.dilation, 0.01);
  }
}

TEST(ExploreTracker, AJumpTooLargeForBothIsSaidAndFoundAgain) {
  const FingertipPainter painter{.noise = 0.6};
  ExploreSettings settings;
  settings.search_reach_px = 0.0;
  ExploreTracker tracker(painter.paint(DotsMotion{}, kRest), settings);
  tracker.next({painter.paint(DotsMotion{}, 1), 0});
  const DotsMotion far{1.25, {2.0, -1.5}};
  const ExploreReading& jumped = tracker.next({painter.paint(far, 2), 1});
  EXPECT_EQ(jumped.mode, ExploreMode::held);
  EXPECT_EQ(jumped.fault, PictureFault::jump);
  EXPECT_EQ(tracker.next({painter.paint(far, 3), 2}).fault, PictureFault::jump);
  // Near rest the absolute estimate finds itself.
  EXPECT_EQ(tracker.next({painter.paint(DotsMotion{1.03, {0.3, 0.0}}, 4), 3}).mode, ExploreMode::absolute);

  ExploreTracker searching(painter.paint(DotsMotion{}, kRest), {});
  searching.next({painter.paint(DotsMotion{}, 1), 0});
  EXPECT_EQ(searching.next({painter.paint(far, 2), 1}).fault, PictureFault::jump);
  const ExploreReading& found = searching.next({painter.paint(far, 3), 2});  // the search begins when it's lost
  EXPECT_EQ(found.mode, ExploreMode::absolute);
  EXPECT_NEAR(found.motion.dilation, far.dilation, 0.02);
  EXPECT_LT((found.motion.shift_px - far.shift_px).norm(), 0.2);
}

TEST(ExploreTracker, PixelTimesTakeOutTheSkewOfAMovingSkin) {
  // 5 mm there and back at 4 mm/s, sideways a fifth of it, grabbed pixel by pixel.
  const PixelTimes times = chip_pixel_times();
  const double interval_s = 324.0 / 1500.0, middle_s = 0.5 * 323.0 / 1500.0;
  const FingertipPainter painter{.noise = 0.3};
  const auto motion_at = [](double t) {
    const double travel = std::fmod(4.0 * t, 10.0);
    const double press_mm = std::min(travel, 10.0 - travel);
    return DotsMotion{dilation_of(press_mm), {0.2 * press_mm, 0.1 * press_mm}};
  };
  double squares[2] = {0.0, 0.0};
  for (const bool known : {false, true}) {
    ExploreSettings settings;
    if (known) settings.times = times;
    ExploreTracker tracker(painter.paint(DotsMotion{}, kRest), settings);
    for (int i = 0; i < 46; ++i) {
      const double start_s = i * interval_s;
      const cv::Mat picture =
          painter.paint([&](double after) { return motion_at(start_s + after); }, times, static_cast<std::uint64_t>(i));
      const ExploreReading& reading = tracker.next({picture, std::llround(1e6 * start_s)});
      EXPECT_NEAR(1e-6 * static_cast<double>(reading.t_us), start_s + (known ? middle_s : 0.0), 2e-6);
      squares[known ? 1 : 0] += (reading.motion.shift_px - motion_at(start_s + middle_s).shift_px).squaredNorm();
    }
  }
  EXPECT_LT(squares[1], 0.6 * squares[0]);
  EXPECT_LT(std::sqrt(squares[1] / 46), 0.1);
}

TEST(ExploreTracker, WhatMakesNoSenseIsNamed) {
  const cv::Mat rest = FingertipPainter{}.paint(DotsMotion{});
  const auto with = [&](auto change) {
    return [&rest, change] {
      ExploreSettings settings;
      change(settings);
      ExploreTracker(rest, settings);
    };
  };
  using S = ExploreSettings;
  EXPECT_THAT(with([](S& s) { s.absolute_from = 0.0; }), ThrowsMessage<Error>(HasSubstr("absolute_from is 0")));
  EXPECT_THAT(with([](S& s) { s.step_correlation = 1.5; }), ThrowsMessage<Error>(HasSubstr("step_correlation is 1.5")));
  EXPECT_THAT(with([](S& s) { s.key_correlation = std::nan(""); }), ThrowsMessage<Error>(HasSubstr("key_correlation")));
  EXPECT_THAT(with([](S& s) { s.search_reach_px = -1.0; }), ThrowsMessage<Error>(HasSubstr("search_reach_px is -1")));
  EXPECT_THAT(with([](S& s) { s.blur_px = 11.0; }), ThrowsMessage<Error>(HasSubstr("blur_px is 11")));
  EXPECT_THAT(with([](S& s) { s.white = 0.0; }), ThrowsMessage<Error>(HasSubstr("white is 0")));
  EXPECT_THAT(with([](S& s) { s.match.most_steps = 0; }), ThrowsMessage<Error>(HasSubstr("most_steps is 0")));
  EXPECT_THAT(with([](S& s) { s.flow.rounds = 0; }), ThrowsMessage<Error>(HasSubstr("rounds is 0")));
  EXPECT_THAT(with([](S& s) { s.times = PixelTimes(17, 17, CV_32FC1); }), ThrowsMessage<Error>(HasSubstr("17x17")));
  EXPECT_THAT([] { ExploreTracker(cv::Mat::zeros(18, 18, CV_8UC1), {}); }, ThrowsMessage<Error>(HasSubstr("dark")));
  EXPECT_EQ(name_of(PictureFault::none), "none");
  EXPECT_EQ(name_of(PictureFault::jump), "neither rest nor the last picture is recognised");
  EXPECT_EQ(name_of(ExploreMode::absolute) + name_of(ExploreMode::relative) + name_of(ExploreMode::held),
            "absoluterelativeheld");
}

}  // namespace
}  // namespace touchstone::sensors
