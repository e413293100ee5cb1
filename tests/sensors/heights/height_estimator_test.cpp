#include "sensors/heights/height_estimator.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "core/error.h"
#include "sensors/heights/height_calibration.h"
#include "tests/sensors/heights/painted_gel.h"

namespace touchstone::sensors {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr int kWidth = 240;
constexpr int kHeight = 180;
constexpr double kScale = 0.053;
constexpr std::size_t kCells = 1U << 17U;  // a smaller table than the default's, to be quick

HeightCalibration calibrated(fixtures::GelPainter& painter, LightCorrection correction, bool compare = false,
                             std::size_t cells = kCells) {
  const std::vector<BallPress> presses = painter.presses(3, 3, 1.0, 0.75);
  HeightCalibrationSettings settings;
  settings.mm_per_px = kScale;
  settings.table.most_cells = cells;
  settings.correction = correction;
  settings.cross_validate = compare;
  return calibrate_height(presses, painter.background(), settings);
}

/// Mean and largest error of a map in um.
struct MapError {
  double mean_um = 0.0;
  double largest_um = 0.0;
};
MapError error_of(const cv::Mat& heights, const cv::Mat& truth) {
  cv::Mat difference;
  cv::absdiff(heights, truth, difference);
  double largest = 0.0;
  cv::minMaxLoc(difference, nullptr, &largest);
  return {1000.0 * cv::mean(difference)[0], 1000.0 * largest};
}

/// A ball of another size than the calibration's, off the middle.
const fixtures::Ball kOther{{5.0, 5.5}, 4.0, 2.0};
fixtures::Relief other_ball(const Eigen::Vector2d& place) {
  return kOther.at(place);
}

TEST(HeightEstimator, HeightOfAnotherBallIsRight) {
  fixtures::GelPainter painter(kWidth, kHeight, kScale, {});
  const std::size_t cells = SlopeTableSettings{}.most_cells;
  const HeightCalibration calibration = calibrated(painter, LightCorrection::none, false, cells);
  HeightEstimator estimator(calibration.model);
  const HeightResult& result = estimator.estimate(painter.paint(other_ball));
  const MapError error = error_of(result.height_mm, painter.heights(other_ball));
  // 0.85 mm deep, noise of 1 DN a pixel.
  EXPECT_LT(error.mean_um, 3.0);
  EXPECT_LT(error.largest_um, 15.0);
  EXPECT_TRUE(result.trusted());
  EXPECT_FALSE(result.contact_at_border);
  EXPECT_GT(estimator.coverage(painter.paint(other_ball)).contact_measured_share, 0.8);
}

TEST(HeightEstimator, SignIsIndentation) {
  fixtures::GelPainter painter(kWidth, kHeight, kScale, {});
  HeightEstimator estimator(calibrated(painter, LightCorrection::none).model);
  const HeightResult& result = estimator.estimate(painter.paint(other_ball));
  const int v = static_cast<int>(5.5 / kScale);
  const int u = static_cast<int>(5.0 / kScale);
  EXPECT_NEAR(result.height_mm.at<float>(v, u), painter.heights(other_ball).at<float>(v, u), 0.02);
  EXPECT_GT(result.height_mm.at<float>(v, u), 0.5F);
  EXPECT_GT(result.slope_u.at<float>(v, u - 15), 0.1F);
  EXPECT_LT(result.slope_u.at<float>(v, u + 15), -0.1F);
  EXPECT_GT(result.slope_v.at<float>(v - 15, u), 0.1F);
  EXPECT_EQ(result.contact.at<unsigned char>(v, u), 255);
  EXPECT_EQ(result.contact.at<unsigned char>(5, 5), 0);
}

TEST(HeightEstimator, RestIsFlat) {
  fixtures::GelPainter painter(kWidth, kHeight, kScale, {});
  HeightEstimator estimator(calibrated(painter, LightCorrection::fitted).model);
  const HeightResult& result = estimator.estimate(painter.rest());
  const MapError error = error_of(result.height_mm, cv::Mat::zeros(kHeight, kWidth, CV_32FC1));
  EXPECT_LT(error.largest_um, 6.0);
  EXPECT_EQ(result.contact_pixels, 0);
}

TEST(HeightEstimator, UnevenLightIsCorrectedByTheLampsBest) {
  fixtures::GelPainter painter(kWidth, kHeight, kScale, {.fall_off = 0.4, .bend_deg = 8.0});
  // Its rim is five lengths of decay from the border; half of it lies beyond the outermost presses, whose lamps hold
  // there.
  const fixtures::Ball corner{{3.0, 2.9}, 4.0, 1.2};
  const auto field = [&](const Eigen::Vector2d& place) { return corner.at(place); };
  const cv::Mat frame = painter.paint(field);
  const cv::Mat truth = painter.heights(field);
  const auto error = [&](LightCorrection correction) {
    const HeightCalibration calibration = calibrated(painter, correction);
    HeightEstimator estimator(calibration.model);
    return error_of(estimator.estimate(frame).height_mm, truth);
  };
  const MapError none = error(LightCorrection::none);
  const MapError background = error(LightCorrection::background);
  const MapError fitted = error(LightCorrection::fitted);
  EXPECT_GT(none.largest_um, 2.0 * fitted.largest_um);
  EXPECT_GT(background.largest_um, 2.0 * fitted.largest_um);
  EXPECT_LT(fitted.mean_um, 4.0);
  EXPECT_LT(fitted.largest_um, 20.0);
}

TEST(HeightCalibration, LeftOutPressesTellWhichCorrectionIsBest) {
  fixtures::GelPainter painter(kWidth, kHeight, kScale, {.fall_off = 0.25, .bend_deg = 6.0});
  const HeightCalibration calibration = calibrated(painter, LightCorrection::fitted, true);
  ASSERT_EQ(calibration.left_out.size(), 3U);
  EXPECT_EQ(calibration.left_out[0].correction, LightCorrection::none);
  EXPECT_LT(calibration.left_out[1].rms, calibration.left_out[0].rms);
  EXPECT_LT(calibration.left_out[2].rms, 0.8 * calibration.left_out[1].rms);
  EXPECT_GT(calibration.coverage.cells_hit, 1000U);
  // The contact ends at a slope of 0.75/sqrt(1 - 0.75^2) = 1.13.
  EXPECT_GT(calibration.coverage.steepest_slope, 0.9);
  EXPECT_LT(calibration.coverage.steepest_slope, 1.14);
}

TEST(HeightCalibration, ErrorFallsWithTheNoise) {
  const auto error = [](double noise) {
    fixtures::GelPainter painter(kWidth, kHeight, kScale, {.noise_DN = noise});
    return calibrated(painter, LightCorrection::none).rms_slope_error;
  };
  const double quiet = error(0.5);
  const double loud = error(4.0);
  EXPECT_GT(loud, 2.5 * quiet);
}

TEST(HeightCalibration, OnePressMakesAModel) {
  fixtures::GelPainter painter(kWidth, kHeight, kScale, {});
  const std::vector<BallPress> presses = {painter.press({{6.0, 5.0}, 1.0, 0.75})};
  HeightCalibrationSettings settings;
  settings.mm_per_px = kScale;
  settings.table.most_cells = kCells;
  const HeightCalibration calibration = calibrate_height(presses, painter.background(1), settings);
  HeightEstimator estimator(calibration.model);
  const MapError error = error_of(estimator.estimate(painter.paint(other_ball)).height_mm, painter.heights(other_ball));
  EXPECT_LT(error.mean_um, 10.0);
}

TEST(HeightCalibration, PressesInOnePlaceGiveTheirLampsToTheWholePicture) {
  fixtures::GelPainter painter(kWidth, kHeight, kScale, {});
  std::vector<BallPress> presses;
  for (int i = 0; i < 4; ++i) presses.push_back(painter.press({{6.0, 5.0}, 1.0, 0.75}));
  HeightCalibrationSettings settings;
  settings.mm_per_px = kScale;
  settings.table.most_cells = kCells;
  const LampModel lamps = calibrate_height(presses, painter.background(), settings).model.lamps;
  for (const Eigen::Matrix3d& node : lamps.nodes) {
    EXPECT_LT((node - lamps.nodes.front()).norm(), 0.01 * node.norm());
  }
}

TEST(HeightEstimator, LightThatHardlyReachesASideIsBoundedNotRefused) {
  fixtures::GelPainter painter(kWidth, kHeight, kScale, {.fall_off = 0.9, .bend_deg = 20.0, .level = 0.7});
  for (const LightCorrection correction : {LightCorrection::background, LightCorrection::fitted}) {
    HeightEstimator estimator(calibrated(painter, correction).model);
    const HeightResult& result = estimator.estimate(painter.paint(other_ball));
    EXPECT_TRUE(cv::checkRange(result.height_mm, true, nullptr, -1.0, 3.0));
  }
}

TEST(HeightCalibration, BadFiguresAreRefused) {
  fixtures::GelPainter painter(kWidth, kHeight, kScale, {});
  const Background background = painter.background(1);
  EXPECT_THAT([&] { calibrate_height({}, background, {.mm_per_px = kScale}); },
              ThrowsMessage<Error>(HasSubstr("no ball press")));
  const std::vector<BallPress> presses = {painter.press({{6.0, 5.0}, 1.0, 0.75})};
  for (const double scale : {0.0, -1.0, std::nan("")}) {
    EXPECT_THROW(calibrate_height(presses, background, {.mm_per_px = scale}), Error);
  }
}

class Faults : public ::testing::Test {
 protected:
  /// A gel and its model, made once.
  struct Learned {
    fixtures::GelPainter painter{kWidth, kHeight, kScale, {}};
    HeightModel model = calibrated(painter, LightCorrection::none).model;
  };
  static Learned& learned() {
    static Learned one;
    return one;
  }
  fixtures::GelPainter& painter_ = learned().painter;
  HeightModel model_ = learned().model;
  HeightEstimator estimator_{model_};
};

TEST_F(Faults, UnfitFramesAreRefused) {
  EXPECT_THAT([&] { estimator_.estimate(cv::Mat(kHeight, kWidth, CV_8UC1)); }, ThrowsMessage<Error>(HasSubstr("grey")));
  EXPECT_THAT([&] { estimator_.estimate(cv::Mat(100, kWidth, CV_8UC3)); },
              ThrowsMessage<Error>(HasSubstr("240 x 100 px; the background is 240 x 180")));
  EXPECT_THAT([&] { estimator_.estimate(cv::Mat()); }, ThrowsMessage<Error>(HasSubstr("empty")));
}

TEST_F(Faults, BlackAndSaturatedFramesAreFlagged) {
  const HeightResult& result = estimator_.estimate(cv::Mat(kHeight, kWidth, CV_8UC3, cv::Scalar(0, 0, 0)));
  EXPECT_TRUE(result.dark);
  EXPECT_FALSE(result.trusted());
  EXPECT_TRUE(cv::checkRange(result.height_mm));
  estimator_.estimate(cv::Mat(kHeight, kWidth, CV_8UC3, cv::Scalar(255, 255, 255)));
  EXPECT_TRUE(result.overexposed);
  EXPECT_FALSE(result.dark);
  EXPECT_DOUBLE_EQ(result.saturated_share, 1.0);
  EXPECT_TRUE(cv::checkRange(result.height_mm));
  estimator_.estimate(painter_.rest());
  EXPECT_TRUE(result.trusted());
}

TEST_F(Faults, ContactThatLeavesThePictureIsFlagged) {
  const fixtures::Ball ball{{0.5, 5.0}, 4.0, 2.0};
  const cv::Mat frame = painter_.paint([&](const Eigen::Vector2d& place) { return ball.at(place); });
  HeightEstimator open(model_, {.border = HeightBorder::free});
  EXPECT_TRUE(open.estimate(frame).contact_at_border);
}

TEST_F(Faults, FreeBorderKeepsAContactsShapeThatLeavesThePicture) {
  const fixtures::Ball ball{{0.5, 5.0}, 4.0, 2.0};
  const auto field = [&](const Eigen::Vector2d& place) { return ball.at(place); };
  const cv::Mat frame = painter_.paint(field);
  cv::Mat truth = painter_.heights(field);
  const auto shape_error = [&](HeightBorder border) {
    HeightEstimator estimator(model_, {.border = border});
    cv::Mat heights = estimator.estimate(frame).height_mm.clone();
    heights -= heights.at<float>(kHeight / 2, kWidth - 1) - truth.at<float>(kHeight / 2, kWidth - 1);
    return error_of(heights, truth).largest_um;
  };
  EXPECT_LT(shape_error(HeightBorder::free), 40.0);  // of 0.85 mm
  EXPECT_GT(shape_error(HeightBorder::zero), 100.0);
}

TEST_F(Faults, FaultyModelsAreRefused) {
  HeightModel model = model_;
  model.table.slopes[5].x() = NAN;
  EXPECT_THAT([&] { HeightEstimator{model}; }, ThrowsMessage<Error>(HasSubstr("aren't finite")));
  model = model_;
  model.mm_per_px = 0.0;
  EXPECT_THAT([&] { HeightEstimator{model}; }, ThrowsMessage<Error>(HasSubstr("mm_per_px")));
}

}  // namespace
}  // namespace touchstone::sensors
