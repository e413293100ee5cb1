#include "sensors/heights/darkness_calibration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "core/error.h"
#include "tests/sensors/heights/painted_darkness.h"

namespace touchstone::sensors {
namespace {

using fixtures::DarkBall;
using fixtures::Layer;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

class DarknessCalibrationTest : public ::testing::Test {
 protected:
  DarknessCalibration calibrate(const std::vector<BallPress>& presses, bool cross_validate = false,
                                bool follow_exposure = true) {
    const RestPicture rest = mean_rest(std::vector<cv::Mat>{painter_.rest()});
    DarknessCalibrationSettings settings;
    settings.scale.mm_per_px = painter_.mm_per_px;
    settings.scale.camera_distance_mm = camera_distance_mm_;
    settings.cross_validate = cross_validate;
    settings.darkening.follow_exposure = follow_exposure;
    return calibrate_darkness(presses, rest, settings);
  }
  /// The largest error of the curve over heights from `low` to `high`.
  double curve_error(const DarknessCurve& curve, double low, double high) {
    double largest = 0.0;
    for (double height = low; height <= high; height += 0.02) {
      largest = std::max(largest, std::abs(curve.height_at(painter_.darkening_of(height)) - height));
    }
    return largest;
  }
  fixtures::DarknessPainter painter_;
  double camera_distance_mm_ = INFINITY;
};

TEST_F(DarknessCalibrationTest, OnePressOfAThinGelFindsTheLaw) {
  const DarknessCalibration made = calibrate({painter_.press({{8.1, 5.9}, 4.0, 1.4, Layer::thin})}, true);
  EXPECT_NEAR(made.depths_mm[0], 1.4, 0.02);
  EXPECT_LT(curve_error(made.model.curve, 0.0, 1.4), 0.02);
  EXPECT_NEAR(made.model.curve.deepest_mm(), 1.4, 0.06);
  EXPECT_LT(made.fitted.rms_mm, 0.01);
  ASSERT_TRUE(made.held_out);
  EXPECT_LT(made.held_out->rms_mm, 0.02);
  EXPECT_LT(made.held_out->largest_mm, 0.08);
  EXPECT_GE(made.held_out->rms_mm, made.fitted.rms_mm);
}

TEST_F(DarknessCalibrationTest, PressesOfAThickGelFindTheLevelTogether) {
  // Round a ball of radius 8 mm the paraboloid is the sphere to 4 um.
  std::vector<BallPress> presses;
  for (const double depth : {0.15, 0.3, 0.6, 1.0}) {
    presses.push_back(painter_.press({{8.1, 5.9}, 8.0, depth, Layer::thick}, 1.0, static_cast<int>(100.0 * depth)));
  }
  // A half space sinks as far as the picture's border: no exposure can be read there.
  const DarknessCalibration made = calibrate(presses, false, false);
  EXPECT_NEAR(made.depths_mm[0], 0.15, 0.03);
  EXPECT_NEAR(made.depths_mm[3], 1.0, 0.03);
  EXPECT_LT(curve_error(made.model.curve, 0.0, 1.0), 0.03);
  EXPECT_GT(made.nearest_to_rest, 0.0);
  // One press alone: half of its depth is never seen in its contact, and the curve goes on straight to rest. The law
  // bends there: straight on from 0.5 mm it is 0.1 mm off at rest.
  const DarknessCalibration alone = calibrate({presses[3]}, false, false);
  EXPECT_NEAR(alone.depths_mm[0], 1.1, 0.05);
  EXPECT_NEAR(alone.nearest_to_rest, painter_.darkening_of(0.5), 0.02);
}

TEST_F(DarknessCalibrationTest, ANearCameraIsTakenIntoAccount) {
  painter_.camera_distance_mm = 17.0;
  const RestPicture rest = mean_rest(std::vector<cv::Mat>{painter_.rest()});
  const auto found = [&](double distance_mm) {
    BallPress press = painter_.press({{9.6, 7.1}, 4.0, 1.6, Layer::thin});
    press.circle = find_dark_circle(press.frame, rest, {}, 4.0, {painter_.mm_per_px, distance_mm}, press.name);
    camera_distance_mm_ = distance_mm;
    return calibrate({press}, true);
  };
  const DarknessCalibration left_out = found(INFINITY);
  const DarknessCalibration known = found(17.0);
  EXPECT_LT(curve_error(known.model.curve, 0.0, 1.6), 0.03);
  EXPECT_GT(curve_error(left_out.model.curve, 0.0, 1.6), 0.05);
  EXPECT_LT(known.held_out->rms_mm, 0.6 * left_out.held_out->rms_mm);
  EXPECT_THAT([&] { found(7.0); }, ThrowsMessage<Error>(HasSubstr("camera_distance_mm 7: it must be at least")));
}

TEST_F(DarknessCalibrationTest, CurvesNeverFallAndAreZeroAtRest) {
  painter_.noise_DN = 12.0;
  const DarknessCurve curve = calibrate({painter_.press({{8.1, 5.9}, 4.0, 0.5, Layer::thin})}).model.curve;
  EXPECT_TRUE(std::is_sorted(curve.heights_mm.begin(), curve.heights_mm.end()));
  EXPECT_EQ(curve.height_at(0.0), 0.0);
  EXPECT_EQ(curve.height_at(-1.0), curve.heights_mm.front());
  EXPECT_GT(curve.height_at(curve.darkest() + 0.1), curve.deepest_mm());
}

TEST_F(DarknessCalibrationTest, ExposureAndGreyGiveTheSameLaw) {
  const DarkBall ball{{8.1, 5.9}, 4.0, 1.2, Layer::thin};
  const DarknessCalibration brighter = calibrate({painter_.press(ball, 1.15)});
  EXPECT_LT(curve_error(brighter.model.curve, 0.0, 1.2), 0.03);
  painter_.channels = 1;
  const DarknessCalibration grey = calibrate({painter_.press(ball)});
  EXPECT_EQ(grey.model.rest.channels, 1);
  EXPECT_LT(curve_error(grey.model.curve, 0.0, 1.2), 0.03);
}

TEST_F(DarknessCalibrationTest, BadInputIsNamed) {
  EXPECT_THAT([&] { calibrate({}); }, ThrowsMessage<Error>(HasSubstr("no presses")));
  BallPress grey = painter_.press({{8.1, 5.9}, 4.0, 1.2, Layer::thin});
  cv::extractChannel(grey.frame, grey.frame, 0);
  EXPECT_THAT([&] { calibrate({grey}); },
              ThrowsMessage<Error>(HasSubstr("painted: the frame is grey; the rest picture is in colour")));
  painter_.mm_per_px = 0.0;
  EXPECT_THAT([&] { calibrate({grey}); }, ThrowsMessage<Error>(HasSubstr("mm_per_px is 0; it must be above 0")));
}

}  // namespace
}  // namespace touchstone::sensors
