// Light that drifts, dirt, and a picture at rest that is no longer the calibration's.

#include "sensors/heights/rest_follower.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "sensors/heights/height_calibration.h"
#include "sensors/heights/height_estimator.h"
#include "tests/sensors/heights/painted_gel.h"

namespace touchstone::sensors {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr int kWidth = 240;
constexpr int kHeight = 180;
constexpr double kScale = 0.053;

const fixtures::Ball kPressed{{6.0, 5.0}, 4.0, 1.2};
fixtures::Relief pressed(const Eigen::Vector2d& place) {
  return kPressed.at(place);
}

class Drifting : public ::testing::Test {
 protected:
  Drifting() {
    HeightCalibrationSettings settings;
    settings.mm_per_px = kScale;
    settings.table.most_cells = 1U << 17U;
    settings.correction = LightCorrection::none;
    static const HeightModel model =
        calibrate_height(painter_.presses(3, 3, 1.0, 0.75), painter_.background(), settings).model;
    model_ = model;
    truth_ = painter_.heights(pressed);
    HeightEstimator estimator(model_);
    still_um_ = error_um(estimator.estimate(painter_.paint(pressed)).height_mm);
  }

  /// The same frame each time, but for what changes: red brighter on the right and darker on the left by `share`.
  cv::Mat lit(const cv::Mat& frame, double share) const {
    cv::Mat changed = frame.clone();
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kWidth; ++u) {
        auto& red = changed.at<cv::Vec3b>(v, u)[2];
        red = cv::saturate_cast<unsigned char>(red * (1.0 + share * (2.0 * u / kWidth - 1.0)));
      }
    }
    return changed;
  }
  double error_um(const cv::Mat& heights) const {
    return 1e3 * cv::norm(heights, truth_, cv::NORM_L2) / std::sqrt(static_cast<double>(truth_.total()));
  }
  HeightEstimator following(double frames) const {
    HeightSettings settings;
    settings.follow.frames = frames;
    return HeightEstimator(model_, settings);
  }

  fixtures::GelPainter painter_{kWidth, kHeight, kScale, {}};
  HeightModel model_;
  cv::Mat truth_;
  double still_um_ = 0.0;
};

/// Red drifts by 15 % from one side to the other within 600 frames; a ball is there in 40 of each 100.
TEST_F(Drifting, LightIsFollowedOutsideOfTheContact) {
  HeightEstimator plain(model_);
  HeightEstimator follows = following(30.0);
  const std::vector<cv::Mat> rest = {painter_.rest(), painter_.rest(), painter_.rest()};
  const std::vector<cv::Mat> touch = {painter_.paint(pressed), painter_.paint(pressed), painter_.paint(pressed)};
  double plain_um = 0.0;
  double followed_um = 0.0;
  for (std::size_t k = 0; k < 600; ++k) {
    const bool touches = k % 100 >= 60;
    const cv::Mat frame = lit((touches ? touch : rest)[k % 3], 0.15 * static_cast<double>(k) / 600.0);
    const HeightResult& result = follows.estimate(frame);
    EXPECT_TRUE(result.trusted()) << k;
    if (k < 560 || !touches) continue;
    followed_um = std::max(followed_um, error_um(result.height_mm));
    plain_um = std::max(plain_um, error_um(plain.estimate(frame).height_mm));
  }
  EXPECT_GT(plain_um, 10.0 * still_um_);
  EXPECT_LT(followed_um, plain_um / 4.0);
  RecordProperty("um", fmt::format("{} {} {}", still_um_, plain_um, followed_um));
}

TEST_F(Drifting, ALongPressDoesNotFade) {
  HeightEstimator follows = following(20.0);
  const cv::Mat frame = painter_.paint(pressed);
  const cv::Mat first = follows.estimate(frame).height_mm.clone();
  for (int k = 0; k < 400; ++k) follows.estimate(frame);
  const double change = cv::norm(first, follows.estimate(frame).height_mm, cv::NORM_INF);
  EXPECT_LT(change, 0.01) << "of " << 0.85 << " mm";
}

TEST_F(Drifting, HotPixelsGoIntoTheBackground) {
  HeightEstimator follows = following(20.0);
  RandomStream random(5, 0, Purpose::kTest);
  std::vector<cv::Point> hot;
  for (int k = 0; k < 60; ++k) {
    hot.emplace_back(static_cast<int>(random.uniform() * kWidth), static_cast<int>(random.uniform() * kHeight));
  }
  const auto with_hot = [&](cv::Mat frame) {
    for (const cv::Point& at : hot) frame.at<cv::Vec3b>(at) = {250, 250, 250};
    return frame;
  };
  const cv::Mat frame = with_hot(painter_.paint(pressed));
  const double before = error_um(follows.estimate(frame).height_mm);
  for (int k = 0; k < 100; ++k) follows.estimate(with_hot(painter_.rest()));
  const double after = error_um(follows.estimate(frame).height_mm);
  EXPECT_GT(before, 1.3 * still_um_);
  EXPECT_LT(after, 1.1 * still_um_) << before;
}

TEST_F(Drifting, AnotherUnitsFramesAreNotTrusted) {
  HeightEstimator estimator(model_);
  EXPECT_TRUE(estimator.estimate(painter_.paint(pressed)).trusted());
  EXPECT_GT(estimator.estimate(painter_.paint(pressed)).rest_share, 0.5);
  fixtures::GelPainter other(kWidth, kHeight, kScale, {.elevation_deg = 45.0});
  const HeightResult& result = estimator.estimate(other.rest());
  EXPECT_TRUE(result.unlike);
  EXPECT_FALSE(result.trusted());
  EXPECT_LT(result.rest_share, 0.05);
  HeightEstimator free(model_, {.border = HeightBorder::free});
  EXPECT_TRUE(free.estimate(other.rest()).trusted()) << "contacts all over are what it's for";
}

TEST_F(Drifting, AScratchIsTakenOutByNewRestFrames) {
  HeightEstimator estimator(model_);
  const auto scratched = [](cv::Mat frame) {
    cv::line(frame, {60, 30}, {150, 120}, {20, 20, 20}, 5);
    return frame;
  };
  const double before = error_um(estimator.estimate(scratched(painter_.paint(pressed))).height_mm);
  const std::vector<cv::Mat> rest = {scratched(painter_.rest()), scratched(painter_.rest())};
  estimator.set_rest(rest);
  EXPECT_EQ(estimator.estimate(scratched(painter_.rest())).contact_pixels, 0);
  const double after = error_um(estimator.estimate(scratched(painter_.paint(pressed))).height_mm);
  EXPECT_LT(after, 0.5 * before);
}

TEST_F(Drifting, RefusesNonsense) {
  const auto with = [&](FollowSettings follow) {
    return [this, follow] {
      HeightSettings settings;
      settings.follow = follow;
      HeightEstimator estimator(model_, settings);
    };
  };
  EXPECT_THAT(with({.frames = -1.0}), ThrowsMessage<Error>(HasSubstr("frames is -1")));
  EXPECT_THAT(with({.still_DN = NAN}), ThrowsMessage<Error>(HasSubstr("still_DN is nan")));
  EXPECT_THAT(with({.reach_mm = INFINITY}), ThrowsMessage<Error>(HasSubstr("reach_mm is inf")));
  HeightEstimator estimator(model_);
  const std::vector<cv::Mat> small = {cv::Mat(10, 10, CV_8UC3, cv::Scalar(1, 2, 3))};
  EXPECT_THAT([&] { estimator.set_rest(small); }, ThrowsMessage<Error>(HasSubstr("10 x 10")));
  EXPECT_THAT([&] { estimator.set_rest({}); }, ThrowsMessage<Error>(HasSubstr("at least one frame")));
}

}  // namespace
}  // namespace touchstone::sensors
