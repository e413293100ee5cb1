// The whole chain on pictures made by formulas: a ball's imprint, with markers that go where the test moves them.

#include "sensors/markers/touch_reader.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "core/error.h"
#include "tests/sensors/heights/painted_gel.h"
#include "tests/sensors/markers/painted_marked_gel.h"
#include "tests/sensors/markers/painted_markers.h"

namespace touchstone::sensors {
namespace {

const Eigen::Vector2d kCentre_px(120, 90);
const fixtures::Ball kBall{kGelScale_mm * kCentre_px, 6.0, 2.2};

LinearForce line(double newton_per_unit) {
  LinearForce force;
  force.newton_per_unit = newton_per_unit;
  return force;
}

class TouchReaderTest : public ::testing::Test {
 protected:
  TouchReaderTest() {
    static const HeightModel model = [] {
      fixtures::GelPainter painter(kGelWidth, kGelHeight, kGelScale_mm, {});
      return small_height_model(painter);
    }();
    calibration_.height = model;
    calibration_.background = frame(nothing, rest_);
    calibration_.normal = line(0.1);
    calibration_.shear = line(2.0);
  }

  /// The gel with its markers at these places.
  cv::Mat frame(const fixtures::Field& field, const std::vector<Eigen::Vector2d>& places) {
    cv::Mat picture = painter_.paint(field);
    const cv::Mat ink =
        fixtures::paint_markers({.width = kGelWidth, .height = kGelHeight, .brightness = 255, .shading = 0}, places);
    cv::multiply(picture, ink, picture, 1.0 / 255);
    return picture;
  }
  /// Markers moved by `motion(distance from the ball's middle, px)`.
  template <typename Motion>
  std::vector<Eigen::Vector2d> moved(Motion&& motion) const {
    std::vector<Eigen::Vector2d> places = rest_;
    for (Eigen::Vector2d& place : places) place += motion((place - kCentre_px).norm());
    return places;
  }

  static fixtures::Relief nothing(const Eigen::Vector2d&) { return {}; }
  static fixtures::Relief ball(const Eigen::Vector2d& place) { return kBall.at(place); }

  fixtures::GelPainter painter_{kGelWidth, kGelHeight, kGelScale_mm, {}};
  std::vector<Eigen::Vector2d> rest_ = fixtures::marker_grid(22.6, kGelWidth, kGelHeight);
  TouchCalibration calibration_;
};

TEST_F(TouchReaderTest, AnUntouchedGelHasNeitherPatchNorForceNorSlip) {
  TouchReader reader(calibration_);
  for (int i = 0; i < 3; ++i) {
    const TouchReading& touch = reader.read({frame(nothing, rest_), i});
    EXPECT_FALSE(touch.patch);
    EXPECT_FALSE(touch.force_ratio);
    EXPECT_LT(touch.height_max_mm, 0.03);
    EXPECT_EQ(touch.shear_N.value(), Eigen::Vector2d(0, 0));
    EXPECT_EQ(touch.normal_N.value(), 0.0);
    EXPECT_TRUE(touch.trusted);
    EXPECT_FALSE(touch.rule_slip);
    EXPECT_EQ(touch.rim.state, SlipState::kNoContact);
    EXPECT_EQ(touch.markers_found, static_cast<int>(rest_.size()));
  }
}

TEST_F(TouchReaderTest, ABallsDepthForceAndShearAreThoseOfTheFormula) {
  TouchReader reader(calibration_);
  const Eigen::Vector2d shift(2.4, -1.8);  // 3 px
  reader.read({frame(ball, rest_), 0});
  const TouchReading& touch = reader.read({frame(ball, moved([&](double) { return shift; })), 1});
  const cv::Mat truth = painter_.heights(ball);
  ASSERT_TRUE(touch.patch);
  EXPECT_LT((touch.patch->centre - kCentre_px).norm(), 3.0);
  EXPECT_NEAR(touch.height_max_mm, kBall.at(kBall.centre_mm).height, 0.15 * touch.height_max_mm);
  EXPECT_NEAR(*touch.normal_N, 0.1 * height_sum_mm3(truth, kGelScale_mm), 0.15 * *touch.normal_N);
  EXPECT_LT((*touch.shear_N - 2.0 * kGelScale_mm * shift).norm(), 0.02 * touch.shear_N->norm());
  ASSERT_TRUE(touch.force_ratio);
  EXPECT_NEAR(*touch.force_ratio, touch.shear_N->norm() / *touch.normal_N, 1e-12);
  EXPECT_FALSE(touch.rim.slips());  // all moved as one
}

TEST_F(TouchReaderTest, WithoutAModelContactAndMotionAreRead) {
  TouchReader reader({.background = calibration_.background});
  const Eigen::Vector2d shift(2.4, -1.8);
  const TouchReading& touch = reader.read({frame(ball, moved([&](double) { return shift; })), 1});
  ASSERT_TRUE(touch.patch);
  EXPECT_LT((touch.patch->centre - kCentre_px).norm(), 3.0);
  EXPECT_LT((touch.moved.px - shift).norm(), 0.05);
  EXPECT_NEAR(touch.moved.turn.value(), 0.0, 0.01);
  EXPECT_TRUE(touch.trusted);
  EXPECT_TRUE(touch.height_mm.empty());
  EXPECT_FALSE(touch.normal_N || touch.shear_N || touch.force_ratio || touch.height_sum_mm3);
  EXPECT_FALSE(touch.beyond_calibration);
}

TEST_F(TouchReaderTest, GreyFramesAreReadWithoutHeights) {
  const auto grey = [&](const cv::Mat& colour) {
    cv::Mat channel;
    cv::extractChannel(colour, channel, 1);
    return channel;
  };
  TouchReader reader({.background = grey(calibration_.background), .shear = line(2.0), .mm_per_px = kGelScale_mm});
  const Eigen::Vector2d shift(2.4, -1.8);
  const TouchReading& touch = reader.read({grey(frame(ball, moved([&](double) { return shift; }))), 1});
  ASSERT_TRUE(touch.patch);
  EXPECT_LT((*touch.shear_N - 2.0 * kGelScale_mm * shift).norm(), 0.02 * touch.shear_N->norm());
  EXPECT_THROW(reader.read({frame(ball, rest_), 2}), Error);
}

TEST_F(TouchReaderTest, AForceBeyondTheSamplesIsSaidToBe) {
  calibration_.shear->highest_seen = 3.5 * kGelScale_mm;
  calibration_.normal->highest_seen = 1e3;
  TouchReader reader(calibration_);
  for (const double far : {3.0, 4.0}) {
    const auto places = moved([&](double) { return Eigen::Vector2d(far, 0); });
    EXPECT_EQ(reader.read({frame(ball, places), static_cast<std::int64_t>(far)}).beyond_calibration, far > 3.5);
  }
}

TEST_F(TouchReaderTest, ARimThatStaysBehindIsSlipUntilItIsForgotten) {
  TouchReader reader(calibration_);
  const double rim_px = kBall.contact_mm / kGelScale_mm;
  const auto with_step = [&](int step) {
    return frame(ball, moved([&](double distance) {
                   return Eigen::Vector2d(1.5 * step * std::max(0.0, 1.0 - std::pow(distance / rim_px, 2)), 0.0);
                 }));
  };
  reader.read({with_step(0), 0});
  EXPECT_TRUE(reader.read({with_step(1), 1}).rim.slips());
  reader.forget_slip();
  EXPECT_FALSE(reader.read({with_step(2), 2}).rim.slips());  // nothing to compare with
  EXPECT_TRUE(reader.read({with_step(3), 3}).rim.slips());
}

TEST_F(TouchReaderTest, WhatCannotBeReadIsRefused) {
  TouchReader reader(calibration_);
  reader.read({frame(nothing, rest_), 5});
  EXPECT_THROW(reader.read({frame(nothing, rest_), 5}), Error);
  EXPECT_THROW(reader.read({cv::Mat(90, 120, CV_8UC3, cv::Scalar(90, 90, 90)), 6}), Error);
  EXPECT_THROW(reader.read({cv::Mat(kGelHeight, kGelWidth, CV_8UC1, cv::Scalar(90)), 6}), Error);
  EXPECT_FALSE(reader.read({frame(nothing, rest_), 6}).patch);
  EXPECT_THROW(TouchReader(calibration_, {.least_patch_px = 0}), Error);
  TouchCalibration bad = calibration_;
  bad.background = cv::Mat(kGelHeight, kGelWidth, CV_8UC3, cv::Scalar(90, 90, 90));  // no markers
  EXPECT_THROW(TouchReader{bad}, Error);
  bad = calibration_;
  bad.height.reset();
  EXPECT_THROW(TouchReader{bad}, Error);  // normal force without heights
  bad.normal.reset();
  EXPECT_THROW(TouchReader{bad}, Error);  // shear without a scale
  bad.mm_per_px = -1.0;
  EXPECT_THROW(TouchReader{bad}, Error);
  bad.mm_per_px = kGelScale_mm;
  EXPECT_NO_THROW(TouchReader{bad});
  bad = calibration_;
  bad.background = calibration_.background(cv::Rect(0, 0, 200, 150)).clone();
  EXPECT_THROW(TouchReader{bad}, Error);
}

}  // namespace
}  // namespace touchstone::sensors
