#include "sensors/heights/darkness_estimator.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "core/error.h"
#include "sensors/heights/darkness_calibration.h"
#include "tests/sensors/heights/painted_darkness.h"

namespace touchstone::sensors {
namespace {

using fixtures::DarkBall;
using fixtures::Layer;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

class DarknessEstimatorTest : public ::testing::Test {
 protected:
  DarknessModel model(bool follow_exposure = true) {
    const RestPicture rest = mean_rest(std::vector<cv::Mat>{painter_.rest()});
    DarknessCalibrationSettings settings;
    settings.scale.mm_per_px = painter_.mm_per_px;
    settings.darkening.follow_exposure = follow_exposure;
    const std::vector presses{painter_.press({{8.1, 5.9}, 4.0, 1.4, Layer::thin})};
    return calibrate_darkness(presses, rest, settings).model;
  }
  /// Root mean square of the heights' errors where the truth is `low` or more.
  double error(const cv::Mat& heights, const fixtures::DarknessPainter::Heights& truth, double low) {
    double squares = 0.0;
    int count = 0;
    for (int v = 0; v < heights.rows; ++v) {
      for (int u = 0; u < heights.cols; ++u) {
        const double true_mm = truth(painter_.mm_per_px * Eigen::Vector2d(u + 0.5, v + 0.5));
        if (true_mm < low) continue;
        squares += std::pow(static_cast<double>(heights.at<float>(v, u)) - true_mm, 2.0);
        ++count;
      }
    }
    return std::sqrt(squares / count);
  }
  fixtures::DarknessPainter painter_;
};

TEST_F(DarknessEstimatorTest, OtherShapesElsewhereAreMeasured) {
  DarknessEstimator estimator(model());
  // A long wave, not a ball, over a part with other light; it fades out before the border.
  const auto wave = [](const Eigen::Vector2d& place) {
    const double away = (place - Eigen::Vector2d(5.0, 4.5)).norm();
    return away > 3.5 ? 0.0
                      : 1.2 * std::pow(std::cos(away / 3.5 * 1.5707963), 2.0) * (0.8 + 0.2 * std::cos(2.0 * place.x()));
  };
  const DarknessResult& result = estimator.estimate(painter_.frame(wave));
  EXPECT_LT(error(result.height_mm, wave, 0.0), 0.02);
  EXPECT_LT(error(result.height_mm, wave, 0.8), 0.03);
  EXPECT_TRUE(result.trusted());
  EXPECT_TRUE(result.exposure_followed);
  EXPECT_NEAR(result.exposure, 1.0, 0.005);
  EXPECT_FALSE(result.contact_at_border);
  EXPECT_EQ(cv::countNonZero(result.contact), result.contact_pixels);
  EXPECT_GT(result.contact_pixels, 1000);
}

TEST_F(DarknessEstimatorTest, NoTouchIsLevelAndNoContact) {
  DarknessEstimator estimator(model());
  const DarknessResult& result = estimator.estimate(painter_.rest(77));
  EXPECT_NEAR(cv::mean(result.height_mm)[0], 0.0, 0.005);
  EXPECT_EQ(result.contact_pixels, 0);
}

TEST_F(DarknessEstimatorTest, ExposureIsFollowedUnlessSwitchedOff) {
  const DarkBall ball{{7.0, 6.0}, 4.0, 1.0, Layer::thin};
  const auto truth = [&](const Eigen::Vector2d& place) { return ball.height_at(place); };
  DarknessEstimator following(model());
  for (const double exposure : {0.7, 1.0, 1.25}) {
    const DarknessResult& result = following.estimate(painter_.press(ball, exposure).frame);
    EXPECT_NEAR(result.exposure, exposure, 0.01);
    EXPECT_LT(error(result.height_mm, truth, 0.0), 0.02);
  }
  DarknessEstimator locked(model(false));
  const DarknessResult& result = locked.estimate(painter_.press(ball, 0.9).frame);
  EXPECT_EQ(result.exposure, 1.0);
  EXPECT_FALSE(result.exposure_followed);
  EXPECT_GT(error(result.height_mm, truth, 0.0), 0.2);
  // A plate over the whole picture: what following takes for exposure, a locked camera shows.
  const auto plate = [](const Eigen::Vector2d&) { return 0.8; };
  EXPECT_LT(error(locked.estimate(painter_.frame(plate)).height_mm, plate, 0.0), 0.02);
  EXPECT_NEAR(following.estimate(painter_.frame(plate)).exposure, 1.0 - painter_.darkening_of(0.8), 0.01);
}

TEST_F(DarknessEstimatorTest, BordersThatDisagreeAreNotFollowed) {
  DarknessEstimator estimator(model());
  const auto slope = [](const Eigen::Vector2d& place) { return 0.09 * place.x(); };
  const DarknessResult& result = estimator.estimate(painter_.frame(slope));
  EXPECT_FALSE(result.exposure_followed);
  EXPECT_EQ(result.exposure, 1.0);
  EXPECT_TRUE(result.contact_at_border);
  EXPECT_LT(error(result.height_mm, slope, 0.0), 0.03);
}

TEST_F(DarknessEstimatorTest, DoubtNamesItsReasons) {
  DarknessModel known = model();
  known.rest.mean(cv::Rect(0, 0, 20, 10)).setTo(3.0);
  DarknessEstimator estimator(known);
  const DarkBall deep{{7.0, 6.0}, 4.0, 2.2, Layer::thin};
  cv::Mat frame = painter_.press(deep).frame;
  frame(cv::Rect(290, 200, 10, 10)).setTo(cv::Scalar(255, 200, 200));
  const DarknessResult& result = estimator.estimate(frame);
  EXPECT_EQ(result.doubt.at<unsigned char>(5, 5), kUnlit);
  EXPECT_EQ(result.height_mm.at<float>(3, 3), 0.0F);
  EXPECT_EQ(result.doubt.at<unsigned char>(205, 295) & kSaturated, kSaturated);
  EXPECT_EQ(result.doubt.at<unsigned char>(120, 140), kDeeper);
  EXPECT_NEAR(static_cast<double>(result.height_mm.at<float>(120, 140)), 2.2, 0.25);
  const double rim = deep.contact_radius() / painter_.mm_per_px;
  EXPECT_EQ(result.doubt.at<unsigned char>(120, 140 + static_cast<int>(1.4 * rim)), kBulged);
  EXPECT_GT(result.deeper_share, 0.01);
  EXPECT_GT(result.bulged_share, 0.05);
  EXPECT_NEAR(result.saturated_share, 100.0 / (320.0 * 240.0), 1e-4);
  EXPECT_FALSE(estimator.estimate(painter_.frame([](const Eigen::Vector2d&) { return 0.0; }, 2.5)).trusted());
  EXPECT_FALSE(estimator.estimate(cv::Mat::zeros(240, 320, CV_8UC3)).trusted());
}

TEST_F(DarknessEstimatorTest, BadInputIsNamed) {
  DarknessEstimator estimator(model());
  const auto reading = [&](const cv::Mat& frame) { return [&estimator, frame] { estimator.estimate(frame); }; };
  EXPECT_THAT(reading(cv::Mat(10, 10, CV_8UC3)), ThrowsMessage<Error>(HasSubstr("is 10 x 10 px")));
  EXPECT_THAT(reading(cv::Mat(240, 320, CV_8UC1)), ThrowsMessage<Error>(HasSubstr("is grey")));
  EXPECT_THAT(reading(cv::Mat(240, 320, CV_8UC4)), ThrowsMessage<Error>(HasSubstr("has 4 channels")));
  EXPECT_THAT(reading(cv::Mat()), ThrowsMessage<Error>(HasSubstr("is empty")));
  DarknessModel falling = model();
  falling.curve.heights_mm.back() = -1.0;
  EXPECT_THAT([&] { DarknessEstimator of(falling); },
              ThrowsMessage<Error>(HasSubstr("darkness model: the curve falls")));
}

}  // namespace
}  // namespace touchstone::sensors
