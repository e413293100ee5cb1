// Lines through samples, the model file that holds them, and the two ratios of [Li2015, sec. 4.4].

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>

#include "core/error.h"
#include "core/random.h"
#include "sensors/markers/gel_force_model.h"
#include "sensors/markers/linear_force.h"
#include "sensors/markers/motion_ratio.h"
#include "sensors/markers/slip_rule.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::sensors {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

TEST(LinearForce, ExactSamplesGiveTheLineAndR2OfOne) {
  const std::array<double, 4> measure{1, 2, 4, 8};
  std::array<double, 4> force{};
  for (std::size_t i = 0; i < 4; ++i) force[i] = 0.25 * measure[i] + 0.5;
  const LinearForce line = fit_linear_force(measure, force, FitLine::kFree);
  EXPECT_NEAR(line.newton_per_unit, 0.25, 1e-14);
  EXPECT_NEAR(line.offset_N, 0.5, 1e-14);
  EXPECT_NEAR(line.r2, 1.0, 1e-14);
  EXPECT_NEAR(line.largest_residual_N, 0.0, 1e-14);
  EXPECT_TRUE(line.has_seen(8.0));
  EXPECT_FALSE(line.has_seen(8.1));
  EXPECT_EQ(line.samples, 4);
}

TEST(LinearForce, R2IsTheSquaredCorrelation) {
  RandomStream random(1, 0, Purpose::kTest);
  std::vector<double> x, y;
  double sx = 0, sy = 0, sxx = 0, syy = 0, sxy = 0;
  for (int i = 0; i < 50; ++i) {
    x.push_back(random.uniform());
    y.push_back(2.0 * x.back() + 0.3 * random.normal());
    sx += x.back();
    sy += y.back();
    sxx += x.back() * x.back();
    syy += y.back() * y.back();
    sxy += x.back() * y.back();
  }
  const double correlation = (50 * sxy - sx * sy) / std::sqrt((50 * sxx - sx * sx) * (50 * syy - sy * sy));
  const LinearForce line = fit_linear_force(x, y, FitLine::kFree);
  EXPECT_NEAR(line.r2, correlation * correlation, 1e-12);
  // Through the origin nothing gets better.
  const LinearForce through = fit_linear_force(x, y, FitLine::kThroughOrigin);
  EXPECT_EQ(through.offset_N, 0.0);
  EXPECT_LE(through.r2, line.r2);
  EXPECT_GE(through.rms_residual_N, line.rms_residual_N);
}

TEST(LinearForce, BadSamplesAreRefused) {
  const std::array<double, 3> good{1, 2, 3}, equal{2, 2, 2}, bad{1, kNaN, 3};
  const std::array<double, 2> few{1, 2};
  for (const FitLine line : {FitLine::kFree, FitLine::kThroughOrigin}) {
    EXPECT_THROW(fit_linear_force(good, few, line), Error);
    EXPECT_THROW(fit_linear_force(few, few, line), Error);
    EXPECT_THROW(fit_linear_force(equal, good, line), Error);
    EXPECT_THROW(fit_linear_force(good, equal, line), Error);
    EXPECT_THROW(fit_linear_force(bad, good, line), Error);
    EXPECT_THROW(fit_linear_force(good, bad, line), Error);
  }
}

TEST(LinearForce, HeightSumIsTheVolumeAtAnyResolution) {
  for (const int scale : {1, 2}) {
    cv::Mat height(240 * scale, 320 * scale, CV_32FC1, cv::Scalar(0));
    height(cv::Rect(100 * scale, 50 * scale, 40 * scale, 20 * scale)).setTo(0.5);
    EXPECT_NEAR(height_sum_mm3(height, 0.05 / scale), 0.5 * 2.0 * 1.0, 1e-9);
  }
  EXPECT_THROW(height_sum_mm3(cv::Mat(), 0.05), Error);
  EXPECT_THROW(height_sum_mm3(cv::Mat(4, 4, CV_8UC1, cv::Scalar(0)), 0.05), Error);
  EXPECT_THROW(height_sum_mm3(cv::Mat(4, 4, CV_32FC1, cv::Scalar(kNaN)), 0.05), Error);
  EXPECT_THROW(height_sum_mm3(cv::Mat(4, 4, CV_32FC1, cv::Scalar(0)), 0.0), Error);
}

TEST(LinearForce, TheStandardErrorIsThatOfNewSamples) {
  RandomStream random(3, 0, Purpose::kTest);
  double squares = 0.0, stated = 0.0;
  constexpr int kTries = 2000;
  for (int i = 0; i < kTries; ++i) {
    std::vector<double> x, y;
    for (int k = 0; k < 6; ++k) {
      x.push_back(k);
      y.push_back(2.0 * k + 0.3 * random.normal());
    }
    const LinearForce line = fit_linear_force(x, y, FitLine::kFree);
    stated += std::pow(line.standard_error_N(), 2) / kTries;
    squares += 0.3 * 0.3 / kTries;
  }
  EXPECT_NEAR(std::sqrt(stated / squares), 1.0, 0.04);  // with 4 degrees of freedom known to 0.8 %
  EXPECT_TRUE(std::isinf(LinearForce{}.standard_error_N()));
}

TEST(LinearForce, ShearIsFittedInBothDirectionsAtOnce) {
  RandomStream random(4, 0, Purpose::kTest);
  std::vector<Eigen::Vector2d> moved, force;
  for (int i = 0; i < 500; ++i) {
    moved.emplace_back(0.2 * random.normal(), 0.1 * random.normal());
    force.emplace_back(3.0 * moved.back() + 0.05 * Eigen::Vector2d(random.normal(), random.normal()));
  }
  const LinearForce line = fit_shear_force(moved, force);
  EXPECT_NEAR(line.newton_per_unit, 3.0, 0.03);  // 0.05 / 0.22 / sqrt(500) = 0.010
  EXPECT_EQ(line.offset_N, 0.0);
  EXPECT_NEAR(line.standard_error_N(), 0.05, 0.004);
  EXPECT_GT(line.r2, 0.98);
  for (Eigen::Vector2d& one : force) one.y() = -one.y();  // y up: what goes along x still fits
  EXPECT_LT(fit_shear_force(moved, force).r2, 0.8);
  for (Eigen::Vector2d& one : force) one = {one.y(), -one.x()};
  EXPECT_THROW(fit_shear_force(moved, force), Error);
  EXPECT_THROW(fit_shear_force(std::span(moved).first(2), std::span(force).first(2)), Error);
  moved[7].x() = kNaN;
  EXPECT_THROW(fit_shear_force(moved, force), Error);
}

TEST(LinearForce, SamplesBeforeSlipEndWhereTheForceStopsRising) {
  const std::vector<double> force{0.0, 0.1, 0.2, 0.3, 0.39, 0.4, 0.4, 0.39};
  EXPECT_EQ(samples_before_slip(force, 0.95), 4u);
  EXPECT_EQ(samples_before_slip(force, 1.0), 5u);
  EXPECT_EQ(samples_before_slip({}, 0.9), 0u);
}

GelForceModel model_of_two_balls() {
  GelForceModel model;
  model.gel = "gelsight-markers";
  model.mm_per_px = 0.053;
  const std::array<double, 3> sum{0.1, 0.21, 0.3}, force{0.05, 0.1, 0.16};
  model.normal = {{"ball 12.7 mm", fit_linear_force(sum, force, FitLine::kFree)},
                  {"ball 4.75 mm", fit_linear_force(force, sum, FitLine::kFree)}};
  model.shear = fit_linear_force(sum, force, FitLine::kThroughOrigin);
  return model;
}

TEST(GelForceModel, AFileGivesTheSameBitsBack) {
  const touchstone::test::TemporaryFolder folder;
  const GelForceModel model = model_of_two_balls();
  save(model, folder.path() / "gel.json");
  const GelForceModel back = load_gel_force_model(folder.path() / "gel.json");
  EXPECT_EQ(to_json(back), to_json(model));
  EXPECT_EQ(normal_line(back, "ball 12.7 mm").newton_per_unit, model.normal[0].line.newton_per_unit);
  GelForceModel without_shear = model;
  without_shear.shear.reset();
  EXPECT_FALSE(gel_force_model_from_json(to_json(without_shear), "x").shear);
}

TEST(LinearForce, ShearForceHasTheDisplacementsDirection) {
  const GelForceModel model = model_of_two_balls();
  const LinearForce& line = shear_line(model);
  const Eigen::Vector2d force = shear_force_N(line, {0.3, -0.4});
  EXPECT_NEAR(force.norm(), line.force_N(0.5), 1e-14);
  EXPECT_NEAR(force.x() / force.y(), -0.75, 1e-12);
  EXPECT_EQ(shear_force_N(line, {0, 0}), Eigen::Vector2d(0, 0));
}

TEST(GelForceModel, WhatIsntThereIsNamed) {
  GelForceModel model = model_of_two_balls();
  try {
    normal_line(model, "ball 12.6 mm");
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("did you mean 'ball 12.7 mm'"), std::string::npos) << error.what();
  }
  model.shear.reset();
  EXPECT_THROW(shear_line(model), Error);
}

TEST(GelForceModel, FaultyFilesAreRefused) {
  const std::string good = to_json(model_of_two_balls());
  const auto refuses = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    const std::size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
    EXPECT_THROW(gel_force_model_from_json(text, "x.json"), Error) << from << " -> " << to;
  };
  refuses("touchstone.gel_force_model", "touchstone.stiffness_force_model");
  refuses("\"version\": 2", "\"version\": 1");
  refuses("\"mm_per_px\": ", "\"mm_per_px\": -");
  refuses("\"mm_per_px\": 0.053,", "");
  refuses("\"gel\":", "\"gell\":");
  refuses("\"samples\": 3", "\"samples\": 2");
  refuses("\"samples\": 3", "\"samples\": 3.5");
  refuses("\"newton_per_unit\": ", "\"newton_per_unit\": -");
  refuses("\"offset_N\": ", "\"offset_N\": 1e999, \"x\": ");
  refuses("ball 4.75 mm", "ball 12.7 mm");
  refuses("ball 4.75 mm", "");
  EXPECT_THROW(gel_force_model_from_json("", "x.json"), Error);
  EXPECT_THROW(gel_force_model_from_json("[1]", "x.json"), Error);
  EXPECT_THROW(to_json(GelForceModel{}), Error);
}

TEST(MotionRatio, CountsPixelsAboveTheThresholdOfSummedChannels) {
  const cv::Mat background(100, 100, CV_8UC3, cv::Scalar(100, 100, 100));
  cv::Mat earlier = background.clone(), later = background.clone();
  earlier(cv::Rect(10, 10, 40, 20)).setTo(cv::Scalar(110, 90, 106));  // 26 levels in all: above 0.1
  earlier(cv::Rect(60, 60, 30, 30)).setTo(cv::Scalar(110, 90, 105));  // 25 levels: not above
  later(cv::Rect(14, 10, 40, 20)).setTo(cv::Scalar(110, 90, 106));    // moved by 4 px
  cv::Mat contact;
  const MotionRatio ratio = motion_ratio(background, earlier, later, {}, &contact);
  EXPECT_EQ(ratio.contact_px, 800);
  EXPECT_EQ(ratio.motion_px, 2 * 4 * 20);
  ASSERT_TRUE(ratio.ratio);
  EXPECT_NEAR(*ratio.ratio, 160.0 / 800.0, 1e-15);
  EXPECT_EQ(cv::countNonZero(contact), 800);
  EXPECT_EQ(contact.at<std::uint8_t>(15, 53), 255);  // where the later picture has it
  EXPECT_EQ(contact.at<std::uint8_t>(15, 13), 0);
  // Which picture comes first doesn't matter to the motion (the thesis's reason for the absolute value).
  EXPECT_EQ(motion_ratio(background, later, earlier).motion_px, ratio.motion_px);
}

TEST(MotionRatio, AGreyPictureIsOneWithThreeLikeChannels) {
  cv::Mat rest(40, 50, CV_8UC1), later(40, 50, CV_8UC1);
  RandomStream random(5, 0, Purpose::kTest);
  for (int i = 0; i < 2000; ++i) {
    rest.at<std::uint8_t>(i / 50, i % 50) = static_cast<std::uint8_t>(100 + 8 * random.normal());
    later.at<std::uint8_t>(i / 50, i % 50) = static_cast<std::uint8_t>(100 + 8 * random.normal());
  }
  const auto colour = [](const cv::Mat& grey) {
    cv::Mat three;
    cv::merge(std::vector<cv::Mat>{grey, grey, grey}, three);
    return three;
  };
  cv::Mat of_grey, of_colour;
  const MotionRatio grey = motion_ratio(rest, rest, later, {}, &of_grey);
  const MotionRatio wanted = motion_ratio(colour(rest), colour(rest), colour(later), {}, &of_colour);
  EXPECT_GT(grey.motion_px, 500);
  EXPECT_EQ(grey.motion_px, wanted.motion_px);
  EXPECT_EQ(cv::norm(of_grey, of_colour, cv::NORM_INF), 0.0);
}

TEST(MotionRatio, MayBeAboveOneAndIsUnknownWithoutContact) {
  const cv::Mat background(50, 50, CV_8UC3, cv::Scalar(100, 100, 100));
  cv::Mat small = background.clone();
  small(cv::Rect(0, 0, 10, 10)).setTo(cv::Scalar::all(150));
  const cv::Mat all(50, 50, CV_8UC3, cv::Scalar::all(150));
  EXPECT_NEAR(*motion_ratio(background, small, all).ratio, 24.0, 1e-12);
  EXPECT_FALSE(motion_ratio(background, background, all).ratio);
  EXPECT_FALSE(motion_ratio(background, background, background, {.least_contact_px = 0}).ratio);
}

TEST(MotionRatio, PicturesWithoutLightHaveAClearOutcome) {
  const cv::Mat background(50, 50, CV_8UC3, cv::Scalar(100, 100, 100));
  const cv::Mat black(50, 50, CV_8UC3, cv::Scalar::all(0)), white(50, 50, CV_8UC3, cv::Scalar::all(255));
  EXPECT_EQ(motion_ratio(background, black, white).contact_px, 2500);  // a light that fails is a change everywhere
  EXPECT_THROW(motion_ratio(background, black, cv::Mat()), Error);
  EXPECT_THROW(motion_ratio(background, black, cv::Mat(50, 51, CV_8UC3, cv::Scalar::all(0))), Error);
  EXPECT_THROW(motion_ratio(background, cv::Mat(50, 50, CV_8UC1, cv::Scalar(0)), white), Error);
  EXPECT_THROW(motion_ratio(cv::Mat(50, 50, CV_16UC1, cv::Scalar(0)), black, white), Error);
  EXPECT_THROW(motion_ratio(background, black, white, {.contact_threshold = kNaN}), Error);
  EXPECT_THROW(motion_ratio(background, black, white, {.motion_threshold = 3.1}), Error);
}

TEST(SlipRule, NeedsBothRatiosAboveTheirThresholds) {
  EXPECT_NEAR(*force_ratio({0.3, -0.4}, 0.25), 2.0, 1e-15);
  EXPECT_FALSE(force_ratio({0.3, 0.4}, 0.01));
  EXPECT_FALSE(force_ratio({0.3, 0.4}, -1.0));
  EXPECT_FALSE(force_ratio({0.3, 0.4}, kNaN));
  EXPECT_FALSE(force_ratio({0.3, 0.4}, 0.0, 0.0));
  EXPECT_TRUE(is_slip(1.1, 0.6));
  EXPECT_FALSE(is_slip(1.0, 0.6));  // above, not at
  EXPECT_FALSE(is_slip(1.1, 0.5));
  EXPECT_FALSE(is_slip(std::nullopt, 0.6));
  EXPECT_FALSE(is_slip(1.1, std::nullopt));
  EXPECT_TRUE(is_slip(0.5, 0.3, {.force_ratio = 0.4, .motion_ratio = 0.2}));
}

}  // namespace
}  // namespace touchstone::sensors
