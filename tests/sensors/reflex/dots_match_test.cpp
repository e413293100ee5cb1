#include "sensors/reflex/dots_match.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/error.h"
#include "sensors/reflex/dots_flow.h"
#include "sensors/reflex/explore_model.h"
#include "tests/sensors/reflex/painted_fingertip.h"

namespace touchstone::sensors {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr double kHalf_px = 9.0;

double error_px(const DotsMotion& found, const DotsMotion& truth) {
  return std::abs(found.dilation - truth.dilation) * kHalf_px + (found.shift_px - truth.shift_px).norm();
}

/// A motion whose dots go up to `reach_px` far, in each of the three kinds.
DotsMotion some_motion(std::uint64_t index, double reach_px) {
  RandomStream random(7, index, Purpose::kTest);
  const auto step = [&] { return reach_px * (2.0 * random.uniform() - 1.0); };
  const double at_edge = step(), x = step(), y = step();
  return {1.0 + at_edge / kHalf_px, {x, y}};
}

TEST(DotsMotion, ThenAndBetweenAreInverse) {
  const DotsMotion a{1.2, {0.5, -1.0}}, b{0.9, {-0.2, 0.3}};
  const Eigen::Vector2d place(3.0, -4.0);
  EXPECT_TRUE(then(a, b)(place).isApprox(b(a(place)), 1e-14));
  EXPECT_TRUE(then(a, between(a, b))(place).isApprox(b(place), 1e-14));
}

TEST(DotsPicture, IsLookedUpBetweenPixels) {
  cv::Mat ramp(18, 18, CV_8UC1);
  for (int row = 0; row < 18; ++row) {
    for (int column = 0; column < 18; ++column)
      ramp.at<unsigned char>(row, column) = static_cast<unsigned char>(row + 2 * column);
  }
  const DotsPicture picture(ramp);
  EXPECT_EQ(picture.place_of(0, 17), Eigen::Vector2d(8.5, -8.5));
  EXPECT_NEAR(picture.at(Eigen::Vector2d(0.3, -1.7)), 25.5 + 0.6 - 1.7, 1e-12);
  EXPECT_EQ(picture.at(Eigen::Vector2d(100.0, 100.0)), 51.0);
  EXPECT_EQ(picture.inside({0.0, 0.0}), 1.0);
  EXPECT_EQ(picture.inside({8.5, 0.0}), 0.5);
  EXPECT_EQ(picture.inside({9.0, 0.0}), 0.0);
  EXPECT_NEAR(DotsPicture(ramp, 1.0).at(Eigen::Vector2d(0.0, 0.0)), 25.5, 1e-9);  // a blur keeps a ramp's inside
}

TEST(DotsMatch, APictureIsItsOwn) {
  const DotsPicture rest(fixtures::FingertipPainter{}.paint(DotsMotion{}));
  const DotsMatch match = match_dots(rest, rest, std::vector<DotsMotion>{{1.05, {0.4, -0.4}}});
  EXPECT_NEAR(match.correlation, 1.0, 1e-4);
  EXPECT_LT(error_px(match.motion, {}), 0.02);
  EXPECT_NEAR(match.overlap, 1.0, 0.01);
}

TEST(DotsMatch, RecoversMotionsFromNoisyCoarsePictures) {
  // Six bits, noise of half a step and more. From rest up to 1 px at the edge in each direction: the root mean square
  // of errors.
  for (const double gain : {1.0, 1.4}) {
    double squares = 0.0;
    constexpr int kTrials = 60;
    for (std::uint64_t i = 0; i < kTrials; ++i) {
      fixtures::FingertipPainter painter{.noise = 0.6, .seed = 1 + i % 10};
      const DotsPicture rest(painter.paint(DotsMotion{}, 1000));
      painter.gain = gain;
      const DotsMotion motion = some_motion(i, 0.7);
      const DotsMatch match = match_dots(DotsPicture(painter.paint(motion, i)), rest, std::vector<DotsMotion>(1));
      EXPECT_GT(match.correlation, 0.9);
      EXPECT_LT(error_px(match.motion, motion), 0.3) << i;
      squares += std::pow(error_px(match.motion, motion), 2);
    }
    EXPECT_LT(std::sqrt(squares / kTrials), 0.12) << gain;  // 0.093 and 0.092: a tenth of a pixel
  }
}

TEST(DotsMatch, WhatLeavesTheViewDoesNotPullTheEstimate) {
  // A press of 5 mm leaves less than half of the dots in view.
  fixtures::FingertipPainter painter{.noise = 0.6};
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    painter.seed = seed;
    const DotsPicture rest(painter.paint(DotsMotion{}, 1000));
    const DotsMotion motion{fixtures::dilation_of(5.0), {0.8, -0.6}};
    const std::vector<DotsMotion> starts = {{1.40, {0.5, -0.4}}};
    const DotsMatch match = match_dots(DotsPicture(painter.paint(motion)), rest, starts);
    EXPECT_LT(match.overlap, 0.5);
    EXPECT_GT(match.overlap, 0.3);
    EXPECT_NEAR(match.motion.dilation, motion.dilation, 0.015);
    EXPECT_LT((match.motion.shift_px - motion.shift_px).norm(), 0.15);
  }
}

TEST(DotsMatch, ThePeakIsFoundAgainFromNowhere) {
  fixtures::FingertipPainter painter{.noise = 0.6};
  for (std::uint64_t i = 0; i < 6; ++i) {
    painter.seed = 1 + i;
    const DotsPicture rest(painter.paint(DotsMotion{}, 1000));
    const DotsMotion motion{1.0 + 0.07 * static_cast<double>(i), {1.5, -2.0 + 0.5 * static_cast<double>(i)}};
    const DotsPicture picture(painter.paint(motion));
    const DotsMatch coarse = search_dots(picture, rest, 3.0);
    const DotsMatch match = match_dots(picture, rest, std::vector<DotsMotion>{coarse.motion});
    EXPECT_LT(error_px(match.motion, motion), 0.3) << i;
    EXPECT_GT(match.correlation, 0.9);
  }
}

TEST(DotsMatch, DotsThatCameOffCostLittle) {
  fixtures::FingertipPainter painter{.noise = 0.6};
  const DotsPicture rest(painter.paint(DotsMotion{}, 1000));
  painter.missing = {1, 6, 13};
  const DotsMotion motion{1.06, {0.3, 0.4}};
  const DotsMatch match = match_dots(DotsPicture(painter.paint(motion)), rest, std::vector<DotsMotion>(1));
  EXPECT_LT(error_px(match.motion, motion), 0.3);
  EXPECT_LT(match.correlation, 0.95);  // and it's seen that something is wrong
}

TEST(DotsMatch, TheSkewOfAPixelByPixelPictureIsTakenOut) {
  const PixelTimes times = chip_pixel_times();
  const double middle_s = 0.5 * 323.0 / 1500.0;
  const DotsMotion middle{1.08, {0.5, -0.3}};
  const DotsVelocity velocity{0.25, {3.0, 2.0}};  // a good half pixel within the picture
  fixtures::FingertipPainter painter{.noise = 0.3};
  const DotsPicture rest(painter.paint(DotsMotion{}, 1000));
  const auto motion_at = [&](double after_s) {
    return DotsMotion{middle.dilation + velocity.dilation_per_s * (after_s - middle_s),
                      middle.shift_px + velocity.px_per_s * (after_s - middle_s)};
  };
  const DotsPicture picture(painter.paint(motion_at, times, 1));
  const double interval_s = 324.0 / 1500.0;
  const KeyFrameHistory past{motion_at(middle_s - interval_s), interval_s};
  const std::vector<DotsMotion> starts = {past.before};
  const DotsMatch plain = match_dots(picture, rest, starts);
  const DotsMatch exact = match_skewed_dots(picture, rest, starts, {}, times, past);
  EXPECT_LT(error_px(exact.motion, middle), 0.12);
  EXPECT_GT(error_px(plain.motion, middle), 1.5 * error_px(exact.motion, middle));
  EXPECT_GT(exact.correlation, plain.correlation);
  // With nothing known of the past nothing is assumed.
  EXPECT_EQ(match_skewed_dots(picture, rest, starts, {}, times, {}).motion, plain.motion);
}

TEST(DotsMatch, WhatMakesNoSenseIsNamed) {
  const cv::Mat painted = fixtures::FingertipPainter{}.paint(DotsMotion{});
  const DotsPicture rest(painted), small(painted(cv::Rect(0, 0, 12, 12)));
  const std::vector<DotsMotion> starts(1);
  const auto with = [&](const DotsMatchSettings& settings) {
    return [&, settings] { match_dots(rest, rest, starts, settings); };
  };
  EXPECT_THAT([&] { match_dots(small, rest, starts); }, ThrowsMessage<Error>(HasSubstr("12x12")));
  EXPECT_THAT(with({.least_overlap = 0.0}), ThrowsMessage<Error>(HasSubstr("least_overlap is 0")));
  EXPECT_THAT(with({.first_step_px = 0.0}), ThrowsMessage<Error>(HasSubstr("first_step_px is 0")));
  EXPECT_THAT(with({.most_steps = 0}), ThrowsMessage<Error>(HasSubstr("most_steps is 0")));
  EXPECT_THAT(with({.least_dilation = 1.1}), ThrowsMessage<Error>(HasSubstr("from 1.1")));
  EXPECT_THAT([&] { search_dots(rest, rest, -1.0); }, ThrowsMessage<Error>(HasSubstr("reach_px is -1")));
  EXPECT_THAT([&] { match_skewed_dots(rest, rest, starts, {}, PixelTimes(12, 12, CV_32FC1), {}); },
              ThrowsMessage<Error>(HasSubstr("pixel times of 12x12")));
  EXPECT_THAT([] { chip_pixel_times(0.0); }, ThrowsMessage<Error>(HasSubstr("interval of 0")));
  EXPECT_THAT([] { DotsPicture(cv::Mat(18, 18, CV_8UC3)); }, ThrowsMessage<Error>(HasSubstr("type")));
  EXPECT_THAT([] { DotsPicture(cv::Mat(7, 18, CV_8UC1)); }, ThrowsMessage<Error>(HasSubstr("18x7")));
  EXPECT_THAT([] { DotsPicture(cv::Mat(18, 18, CV_32FC1, std::nanf(""))); }, ThrowsMessage<Error>(HasSubstr("finite")));
}

TEST(DotsCorrelation, IsNothingWhereNothingVaries) {
  const DotsPicture flat(cv::Mat(18, 18, CV_8UC1, 20)), rest(fixtures::FingertipPainter{}.paint(DotsMotion{}));
  EXPECT_EQ(correlate(flat, rest, {}).correlation, 0.0);
  EXPECT_EQ(correlate(rest, rest, {1.0, {100.0, 0.0}}).overlap, 0.0);
}

/// Dots that are smooth on the scale of a pixel.
fixtures::FingertipPainter smooth_painter() {
  return {.spacing_px = 6.0, .jitter_px = 1.5, .radius_px = 1.6, .edge_px = 3.0};
}

TEST(DotsFlow, ASmallStepIsFoundByOneSolution) {
  const DotsMotion step{1.01, {0.10, -0.05}};
  fixtures::FingertipPainter painter = smooth_painter();
  fixtures::FingertipPainter coarse;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    painter.seed = coarse.seed = seed;
    const auto found = dots_flow(DotsPicture(painter.paint(DotsMotion{}), 1.0), DotsPicture(painter.paint(step), 1.0));
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->dilation - 1.0, 0.01, 0.003);
    EXPECT_LT((found->shift_px - step.shift_px).norm(), 0.03);
    // The chip's dots of 1.5 px are too coarse for gradients: the solution of [Knoop2013] is short by a third or so.
    const auto short_one = dots_flow(DotsPicture(coarse.paint(DotsMotion{})), DotsPicture(coarse.paint(step)));
    ASSERT_TRUE(short_one);
    EXPECT_GT(short_one->shift_px.x(), 0.04);
    EXPECT_LT(short_one->shift_px.x(), 0.085);
  }
}

TEST(DotsFlow, RoundsTakeInALargeStepAndLightThatChanges) {
  fixtures::FingertipPainter painter = smooth_painter();
  painter.noise = 0.6;
  double once = 0.0, often = 0.0;
  constexpr int kTrials = 20;
  for (std::uint64_t i = 0; i < kTrials; ++i) {
    painter.seed = 1 + i % 5;
    const DotsMotion step = some_motion(i, 0.6);
    const DotsPicture before(painter.paint(DotsMotion{}, 100 + i), 1.0);
    painter.gain = 1.15;
    const DotsPicture now(painter.paint(step, i), 1.0);
    painter.gain = 1.0;
    const auto rough = dots_flow(before, now);
    const auto fine = dots_flow(before, now, {.rounds = 20, .free_light = true});
    ASSERT_TRUE(rough && fine);
    once += std::pow(error_px(*rough, step), 2) / kTrials;
    often += std::pow(error_px(*fine, step), 2) / kTrials;
  }
  EXPECT_LT(std::sqrt(often), 0.15);
  EXPECT_GT(std::sqrt(once), 2.0 * std::sqrt(often));
}

TEST(DotsFlow, WithoutGradientsThereIsNone) {
  const DotsPicture flat(cv::Mat(18, 18, CV_8UC1, 20));
  EXPECT_FALSE(dots_flow(flat, flat));
  // Stripes don't tell what moves along them.
  cv::Mat stripes(18, 18, CV_8UC1);
  for (int column = 0; column < 18; ++column) stripes.col(column).setTo(20 + 10 * std::sin(column));
  EXPECT_FALSE(dots_flow(DotsPicture(stripes), DotsPicture(stripes)));
}

TEST(DotsFlow, WhatIsTooLargeIsNotBelieved) {
  const fixtures::FingertipPainter painter;
  const DotsPicture before(painter.paint(DotsMotion{})), now(painter.paint(DotsMotion{1.0, {0.5, 0.0}}));
  EXPECT_FALSE(dots_flow(before, now, {.most_step_px = 0.1}));
  const DotsPicture small(painter.paint(DotsMotion{})(cv::Rect(0, 0, 12, 12)));
  EXPECT_THAT([&] { dots_flow(before, small); }, ThrowsMessage<Error>(HasSubstr("12x12")));
  EXPECT_THAT([&] { dots_flow(before, now, {.rounds = 0}); }, ThrowsMessage<Error>(HasSubstr("rounds is 0")));
  EXPECT_THAT([&] { dots_flow(before, now, {.most_step_px = 0.0}); },
              ThrowsMessage<Error>(HasSubstr("most_step_px is 0")));
}

TEST(PressLaw, ThePinholesDistanceIsFound) {
  std::vector<DilationSample> samples;
  for (int i = 0; i <= 50; ++i) samples.push_back({fixtures::dilation_of(0.1 * i, 16.03), 0.1 * i});
  const DilationPress law = fit_dilation_press(samples);
  EXPECT_NEAR(law.mm[0], 16.03, 1e-9);
  EXPECT_NEAR(law.press_mm(fixtures::dilation_of(5.0, 16.03)), 5.0, 1e-9);
  EXPECT_NEAR(law.rms_residual_mm, 0.0, 1e-10);
  // A skin that flattens as it comes: one term isn't enough.
  for (DilationSample& one : samples) {
    const double nearer = 1.0 - 1.0 / one.dilation;
    one.press_mm = nearer * (16.0 + nearer * (4.0 - 3.0 * nearer));
  }
  EXPECT_GT(fit_dilation_press(samples).rms_residual_mm, 0.02);
  EXPECT_NEAR(fit_dilation_press(samples, 3).mm[1], 4.0, 1e-9);
  EXPECT_LT(fit_dilation_press(samples, 3).rms_residual_mm, 1e-10);

  EXPECT_THAT([&] { fit_dilation_press(samples, 4); }, ThrowsMessage<Error>(HasSubstr("4 terms")));
  EXPECT_THAT([&] { fit_dilation_press(std::span(samples).first(2)); }, ThrowsMessage<Error>(HasSubstr("2 samples")));
  EXPECT_THAT(
      [&] {
        fit_dilation_press(std::vector<DilationSample>(9, {1.1, 2.0}), 2);
      },
      ThrowsMessage<Error>(HasSubstr("too few different")));
  samples[4].dilation = 0.0;
  EXPECT_THAT([&] { fit_dilation_press(samples); }, ThrowsMessage<Error>(HasSubstr("sample 4")));
}

TEST(PressLaw, TheTextsExponentialIsFoundThroughNoise) {
  RandomStream random(4, 0, Purpose::kTest);
  std::vector<PressSample> samples;
  for (int i = 0; i <= 200; ++i) {
    const double press = 0.025 * i;
    samples.push_back({press, 1.1293 * std::expm1(0.4677 * press) + 0.14 * random.normal()});
  }
  const ExponentialForce law = fit_exponential_force(samples);
  EXPECT_NEAR(law.scale_N, 1.1293, 0.05);
  EXPECT_NEAR(law.rate_per_mm, 0.4677, 0.01);
  EXPECT_NEAR(law.rms_residual_N, 0.14, 0.02);
  EXPECT_EQ(law.force_N(-1.0), 0.0);
  for (PressSample& one : samples) one.force_N = 1.1293 * std::expm1(0.4677 * one.press_mm);
  EXPECT_NEAR(fit_exponential_force(samples).rate_per_mm, 0.4677, 1e-6);

  EXPECT_THAT([&] { fit_exponential_force(std::span(samples).first(3)); },
              ThrowsMessage<Error>(HasSubstr("3 samples")));
  for (PressSample& one : samples) one.force_N = -std::expm1(0.4677 * one.press_mm);
  EXPECT_THAT([&] { fit_exponential_force(samples); }, ThrowsMessage<Error>(HasSubstr("fall")));
  for (PressSample& one : samples) one.force_N = std::sqrt(one.press_mm);
  EXPECT_THAT([&] { fit_exponential_force(samples); }, ThrowsMessage<Error>(HasSubstr("no rate")));
  samples[1].force_N = std::nan("");
  EXPECT_THAT([&] { fit_exponential_force(samples); }, ThrowsMessage<Error>(HasSubstr("finite")));
}

TEST(ExploreModel, GoesFromMotionToPressForceAndShear) {
  ExploreModel model;
  model.press = {1, {16.0, 0.0, 0.0}, 0.0};
  model.force = {1.1293, 0.4677, 0.0};
  RandomStream random(5, 0, Purpose::kTest);
  std::vector<LateralSample> lateral;
  for (int i = 0; i < 10; ++i) {
    const Eigen::Vector2d mm(random.normal(), random.normal());
    const double dilation = 1.0 + 0.4 * random.uniform();
    lateral.push_back({{dilation, mm / 0.65 * dilation}, mm});
  }
  model.lateral_mm_per_px = fit_lateral(lateral);
  EXPECT_TRUE(model.lateral_mm_per_px.isApprox(0.65 * Eigen::Matrix2d::Identity(), 1e-12));
  model.shear = ShearLaw{0.5 * Eigen::Matrix2d::Identity(), 0.1 * Eigen::Matrix2d::Identity(), 0.0};
  const ExploreForce force = estimate(model, {fixtures::dilation_of(2.0), {2.0, 0.0}});
  EXPECT_NEAR(force.press_mm, 2.0, 1e-12);
  EXPECT_NEAR(force.force_N, 1.1293 * std::expm1(0.4677 * 2.0), 1e-12);
  EXPECT_NEAR(force.lateral_mm.x(), 0.65 * 2.0 * 14.0 / 16.0, 1e-12);
  EXPECT_NEAR(force.shear_N.x(), (0.5 + 0.1 * force.force_N) * force.lateral_mm.x(), 1e-12);

  EXPECT_THAT([&] { fit_lateral(std::span(lateral).first(3)); }, ThrowsMessage<Error>(HasSubstr("3 samples")));
  for (LateralSample& one : lateral) one.motion.shift_px.y() = 0.0;
  EXPECT_THAT([&] { fit_lateral(lateral); }, ThrowsMessage<Error>(HasSubstr("one line")));
  lateral[2].motion.dilation = 0.0;
  EXPECT_THAT([&] { fit_lateral(lateral); }, ThrowsMessage<Error>(HasSubstr("sample 2")));
}

}  // namespace
}  // namespace touchstone::sensors
