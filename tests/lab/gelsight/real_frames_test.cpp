// Calibration and heights on recorded frames of a real GelSight Mini: 20 presses of one steel ball, each with the
// camera's own white balance, up to a third of a contact's pixels with a channel at 255, circles drawn by hand.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "lab/gelsight/ball_press_table.h"
#include "sensors/heights/height_calibration.h"
#include "sensors/heights/height_estimator.h"
#include "tests/support/recordings.h"

namespace touchstone::lab {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr double kScale = 0.05107;

class RealFrames : public ::testing::Test {
 protected:
  void SetUp() override {
    TS_NEEDS_RECORDINGS(folder_);
    datasets::TableFrames frames(folder_);
    background_ = read_background(frames, {folder_ / "rest.png"});
    presses_ = read_ball_presses(frames, read_ball_press_table(frames, folder_ / "presses.csv"));
    ASSERT_GE(presses_.size(), 10U);
  }
  static sensors::HeightCalibrationSettings settings(sensors::SlopeRegressor slopes) {
    sensors::HeightCalibrationSettings settings;
    settings.mm_per_px = kScale;
    settings.slopes = slopes;
    settings.correction = sensors::LightCorrection::none;
    settings.table.most_cells = 1U << 17U;
    return settings;
  }
  std::vector<sensors::BallPress> without_circles() const {
    std::vector<sensors::BallPress> all = presses_;
    for (sensors::BallPress& press : all) press.circle.reset();
    return all;
  }
  std::filesystem::path folder_ = test::recordings_of("gelsight-mini");
  sensors::Background background_;
  std::vector<sensors::BallPress> presses_;
};

TEST_F(RealFrames, EveryPressIsAcceptedWithAndWithoutItsCircle) {
  for (const auto& presses : {presses_, without_circles()}) {
    const sensors::HeightCalibration calibration =
        sensors::calibrate_height(presses, background_, settings(sensors::SlopeRegressor::table));
    EXPECT_TRUE(calibration.model.white_balance);
    for (std::size_t i = 0; i < presses.size(); ++i) {
      const sensors::PressUse& use = calibration.presses[i];
      EXPECT_TRUE(use.flaw.empty()) << use.flaw;
      EXPECT_LT((use.circle.centre - presses_[i].circle->centre).norm(), 0.25 * presses_[i].circle->radius) << use.name;
      EXPECT_NEAR(use.circle.radius, presses_[i].circle->radius, 6.0) << use.name;
    }
  }
}

/// RMS of heights against the ball's cap within the circle, both aligned on its rim.
double aligned_error(const cv::Mat& heights, const sensors::ContactCircle& circle, double ball_mm) {
  double rim = 0.0;
  double squares = 0.0;
  int rim_pixels = 0;
  std::vector<double> off;
  for (int v = 0; v < heights.rows; ++v) {
    for (int u = 0; u < heights.cols; ++u) {
      const double r = (Eigen::Vector2d(u + 0.5, v + 0.5) - circle.centre).norm();
      if (r > circle.radius + 0.5) continue;
      const double cap = std::sqrt(std::max(ball_mm * ball_mm - r * r * kScale * kScale, 0.0));
      const double here = static_cast<double>(heights.at<float>(v, u)) - cap;
      if (r > circle.radius - 0.5) {
        rim += here;
        ++rim_pixels;
      } else {
        off.push_back(here);
      }
    }
  }
  for (const double one : off) squares += std::pow(one - rim / rim_pixels, 2);
  return std::sqrt(squares / static_cast<double>(off.size()));
}

/// RMS of what a frame's heights change by when its channels are made stronger and cut off at 255.
double change_by(sensors::HeightEstimator& estimator, const cv::Mat& frame, const cv::Scalar& factors) {
  cv::Mat other;
  cv::multiply(frame, factors, other);
  const cv::Mat plain = estimator.estimate(frame).height_mm.clone();
  return cv::norm(plain, estimator.estimate(other).height_mm) / std::sqrt(static_cast<double>(plain.total()));
}

TEST_F(RealFrames, ANetworkReadsPressesThatItNeverSaw) {
  std::vector<sensors::BallPress> seen;
  std::vector<sensors::BallPress> unseen;
  for (std::size_t i = 0; i < presses_.size(); ++i) (i % 5 == 2 ? unseen : seen).push_back(presses_[i]);
  const sensors::HeightCalibration calibration =
      sensors::calibrate_height(seen, background_, settings(sensors::SlopeRegressor::best));
  ASSERT_TRUE(calibration.model.network.has_value());
  EXPECT_LT(*calibration.network_left_out, 0.15);
  sensors::HeightEstimator estimator(calibration.model);
  double squares = 0.0;
  double inner_squares = 0.0;
  for (const sensors::BallPress& press : unseen) {
    const sensors::HeightResult& result = estimator.estimate(press.frame);
    EXPECT_FALSE(result.dark || result.flat);
    const double error = aligned_error(result.height_mm, *press.circle, press.ball_radius_mm);
    // A circle drawn by hand is good to some 2 px; the cap's edge is so steep that its outermost tenth counts most.
    sensors::ContactCircle inner = *press.circle;
    inner.radius *= 0.9;
    const double inner_error = aligned_error(result.height_mm, inner, press.ball_radius_mm);
    RecordProperty("height_error_um_" + press.name.substr(0, 8), static_cast<int>(1000.0 * error));
    RecordProperty("inner_height_error_um_" + press.name.substr(0, 8), static_cast<int>(1000.0 * inner_error));
    EXPECT_LT(error, 0.2) << press.name;
    squares += error * error;
    inner_squares += inner_error * inner_error;
    EXPECT_LT(change_by(estimator, press.frame, {0.8, 0.8, 0.8}), 0.01) << press.name;
    EXPECT_LT(change_by(estimator, press.frame, {1.0, 0.8, 0.9}), 0.01) << press.name;
    EXPECT_LT(change_by(estimator, press.frame, {1.2, 0.8, 1.2}), 0.08) << press.name;  // 40 % of blue is cut off
  }
  EXPECT_LT(std::sqrt(squares / static_cast<double>(unseen.size())), 0.13);
  EXPECT_LT(std::sqrt(inner_squares / static_cast<double>(unseen.size())), 0.11);
  cv::Mat rest;
  background_.mean.convertTo(rest, CV_8UC3);
  const cv::Mat level = estimator.estimate(rest).height_mm;
  EXPECT_LT(cv::norm(level) / std::sqrt(static_cast<double>(level.total())), 0.05);
}

TEST_F(RealFrames, PicturesThatArentPressesOfThisGelAreNamed) {
  std::vector<sensors::BallPress> all(presses_.begin(), presses_.begin() + 4);
  const auto add = [&](const char* name, auto change) {
    sensors::BallPress press = presses_[5];
    press.name = name;
    press.frame = press.frame.clone();
    change(press);
    all.push_back(press);
  };
  add("upside down", [](sensors::BallPress& p) { cv::flip(p.frame, p.frame, 0); });
  add("untouched", [&](sensors::BallPress& p) { background_.mean.convertTo(p.frame, CV_8UC3); });
  add("two balls", [&](sensors::BallPress& p) {
    // Another press's ball, in its own place: the brighter of both frames where one of them is bright.
    cv::Mat other;
    cv::warpAffine(p.frame, other, cv::Matx23d(1, 0, 0, 0, 1, 95), p.frame.size(), cv::INTER_NEAREST,
                   cv::BORDER_REPLICATE);
    const int from = static_cast<int>(p.circle->centre.y()) + 48;
    other.rowRange(from, p.frame.rows).copyTo(p.frame.rowRange(from, p.frame.rows));
  });
  add("grey", [](sensors::BallPress& p) {
    cv::cvtColor(p.frame, p.frame, cv::COLOR_BGR2GRAY);
    cv::cvtColor(p.frame, p.frame, cv::COLOR_GRAY2BGR);
    p.frame.setTo(cv::Scalar(40, 40, 40));
  });
  const sensors::HeightCalibration calibration =
      sensors::calibrate_height(all, background_, settings(sensors::SlopeRegressor::table));
  EXPECT_EQ(calibration.model.presses, 4);
  EXPECT_THAT(calibration.presses[4].flaw, HasSubstr("upside down: only"));
  EXPECT_THAT(calibration.presses[5].flaw, HasSubstr("untouched: nothing is pressed"));
  EXPECT_THAT(calibration.presses[6].flaw, HasSubstr("two balls: "));
  EXPECT_THAT(calibration.presses[7].flaw, HasSubstr("grey: "));

  // A rest frame that belongs to another sensor: all presses are refused, none is averaged in.
  cv::Mat turned;
  cv::flip(background_.mean, turned, 0);
  sensors::Background other = background_;
  other.mean = turned;
  EXPECT_THAT([&] { sensors::calibrate_height(presses_, other, settings(sensors::SlopeRegressor::table)); },
              ThrowsMessage<Error>(HasSubstr("none of 20 ball presses can be used")));
}

}  // namespace
}  // namespace touchstone::lab
