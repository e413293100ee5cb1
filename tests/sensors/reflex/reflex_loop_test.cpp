#include "sensors/reflex/reflex_loop.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/error.h"
#include "core/random.h"

namespace touchstone::sensors {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

/// A skin whose statistics follow the force as a rendered one's do: brighter and fewer dots.
ChipStatistics pressed(double force_N, double noise = 0.0, RandomStream* random = nullptr) {
  const auto with_noise = [&](double value) { return value + (random != nullptr ? noise * random->normal() : 0.0); };
  ChipStatistics s;
  s.maximum = static_cast<int>(std::lround(std::clamp(with_noise(36.0 + 2.0 * force_N), 0.0, 63.0)));
  s.minimum = static_cast<int>(std::lround(std::clamp(with_noise(6.0 + 0.5 * force_N), 0.0, 20.0)));
  s.squal = static_cast<int>(std::lround(std::clamp(with_noise(90.0 - 4.0 * force_N), 0.0, 255.0)));
  s.average = 15.0 + 1.5 * force_N;
  return s;
}

/// Present if MAX > 37.
ReflexModel known_model() {
  ReflexModel model;
  model.tree.nodes.resize(3);
  model.tree.nodes[0] = {ChipFeature::maximum, 37.0, 1, 2, false};
  model.tree.nodes[1].force_present = true;
  model.force.coefficients = {-10.0, 0.0, 0.0, 0.0, 1.0 / 1.5};
  model.shear = ShearLaw{Eigen::Matrix2d::Identity() * 0.01, Eigen::Matrix2d::Identity() * 0.001, 0.1};
  return model;
}

TEST(StatisticsForce, ALinearLawIsFoundExactlyAndNegativesAreNone) {
  RandomStream random(1, 0, Purpose::kTest);
  std::vector<StatisticsForceSample> samples;
  for (int i = 0; i < 50; ++i) {
    ChipStatistics s;
    s.minimum = static_cast<int>(10.0 * random.uniform());
    s.maximum = 30 + static_cast<int>(30.0 * random.uniform());
    s.squal = static_cast<int>(200.0 * random.uniform());
    s.average = 11.0 + 15.0 * random.uniform();
    samples.push_back({s, 20.0 + 0.1 * s.maximum - 0.2 * s.minimum - 0.01 * s.squal + 0.3 * s.average});
  }
  const StatisticsForce model = fit_statistics_force(samples);
  EXPECT_NEAR(model.coefficients[0], 20.0, 1e-9);
  EXPECT_NEAR(model.coefficients[1], 0.1, 1e-10);
  EXPECT_NEAR(model.coefficients[2], -0.2, 1e-10);
  EXPECT_NEAR(model.coefficients[3], -0.01, 1e-11);
  EXPECT_NEAR(model.coefficients[4], 0.3, 1e-10);
  EXPECT_LT(model.rms_residual_N, 1e-10);
  StatisticsForce pulled = model;
  pulled.coefficients[0] = -1000.0;
  EXPECT_EQ(pulled.force_N(samples[0].statistics), 0.0);
}

TEST(StatisticsForce, ProductsFollowACurveThatALineDoesNot) {
  std::vector<StatisticsForceSample> samples;
  for (int i = 0; i < 400; ++i) {
    const double brightness = 0.1 * i;
    samples.push_back(
        {{.maximum = 63, .minimum = 0, .squal = i % 97, .average = brightness}, 0.01 * std::pow(brightness, 2)});
  }
  EXPECT_GT(fit_statistics_force(samples, 1).rms_residual_N, 0.5);
  EXPECT_LT(fit_statistics_force(samples, 2).rms_residual_N, 1e-6);
}

TEST(StatisticsForce, StatisticsThatNeverChangeDoNoHarm) {
  std::vector<StatisticsForceSample> samples;
  for (int i = 0; i < 60; ++i) samples.push_back({{.maximum = i, .minimum = 0, .squal = 7, .average = 0.0}, 0.1 * i});
  const StatisticsForce model = fit_statistics_force(samples);
  for (const StatisticsForceSample& one : samples) EXPECT_NEAR(model.force_N(one.statistics), one.force_N, 1e-9);
  for (const double coefficient : model.coefficients) EXPECT_LT(std::abs(coefficient), 1.0);
}

TEST(StatisticsForce, WhatDoesNotFitIsNamed) {
  std::vector<StatisticsForceSample> samples(40, {pressed(1.0), 1.0});
  EXPECT_THAT([&] { fit_statistics_force(samples, 3); }, ThrowsMessage<Error>(HasSubstr("degree is 3")));
  EXPECT_THAT([&] { fit_statistics_force(std::span(samples).first(9)); }, ThrowsMessage<Error>(HasSubstr("9 samples")));
  EXPECT_THAT([&] { fit_statistics_force(std::span(samples).first(29), 2); },
              ThrowsMessage<Error>(HasSubstr("29 samples")));
  samples[3].force_N = std::nan("");
  EXPECT_THAT([&] { fit_statistics_force(samples); }, ThrowsMessage<Error>(HasSubstr("sample 3")));
}

TEST(ShearLaw, IsFoundAlsoForAChipThatIsTurned) {
  RandomStream random(2, 0, Purpose::kTest);
  Eigen::Matrix2d turned;
  turned << 0.8, -0.6, 0.6, 0.8;
  std::vector<ShearSample> samples;
  for (int i = 0; i < 40; ++i) {
    const Eigen::Vector2d counts(20.0 * random.normal(), 20.0 * random.normal());
    const double normal_N = 5.0 * random.uniform();
    samples.push_back({counts, normal_N, (0.02 + 0.004 * normal_N) * turned * counts});
  }
  const ShearLaw law = fit_shear_law(samples);
  EXPECT_TRUE(law.stiffness.isApprox(0.02 * turned, 1e-10));
  EXPECT_TRUE(law.per_N.isApprox(0.004 * turned, 1e-10));
  EXPECT_LT(law.rms_residual_N, 1e-12);

  EXPECT_THAT([&] { fit_shear_law(std::span(samples).first(7)); }, ThrowsMessage<Error>(HasSubstr("7 samples")));
  std::vector<ShearSample> along = samples;
  for (ShearSample& one : along) one.displacement.y() = 2.0 * one.displacement.x();
  EXPECT_THAT([&] { fit_shear_law(along); }, ThrowsMessage<Error>(HasSubstr("along one line")));
  along = samples;
  for (ShearSample& one : along) one.normal_N = 2.0;
  EXPECT_THAT([&] { fit_shear_law(along); }, ThrowsMessage<Error>(HasSubstr("one normal")));
  for (ShearSample& one : along) one.normal_N = 0.0;
  EXPECT_THAT([&] { fit_shear_law(along); }, ThrowsMessage<Error>(HasSubstr("are 0")));
  samples[5].shear_N.x() = std::nan("");
  EXPECT_THAT([&] { fit_shear_law(samples); }, ThrowsMessage<Error>(HasSubstr("sample 5")));
}

TEST(MotionCounts, SumWithinAContactAndForgetAfterIt) {
  MotionCounts counts(3);
  const auto step = [&](int dx, int dy, bool present) {
    ChipStatistics s;
    s.dx = dx;
    s.dy = dy;
    return counts.next(s, present);
  };
  EXPECT_EQ(step(5, 5, false).norm(), 5.0 * std::sqrt(2.0));  // not yet long without force
  step(5, 5, false);
  EXPECT_EQ(step(5, 5, false).norm(), 0.0);
  EXPECT_EQ(step(1, -2, true), Eigen::Vector2d(1.0, -2.0));
  EXPECT_EQ(step(1, -2, true), Eigen::Vector2d(2.0, -4.0));
  EXPECT_EQ(step(1, 0, false), Eigen::Vector2d(3.0, -4.0));  // a frame that the tree gets wrong
  EXPECT_EQ(step(1, 0, true), Eigen::Vector2d(4.0, -4.0));
  EXPECT_EQ(counts.cut_off(), 0);
  step(127, 0, true);
  EXPECT_EQ(counts.cut_off(), 1);
  for (int i = 0; i < 3; ++i) step(0, 0, false);
  EXPECT_EQ(step(0, 0, true), Eigen::Vector2d(0.0, 0.0));
  EXPECT_EQ(counts.frames(), 1);
}

TEST(ReflexLoop, StopsInTheFrameThatShowsAForce) {
  ReflexLoop loop(known_model(), {});
  for (int i = 0; i < 100; ++i) EXPECT_FALSE(loop.next(pressed(0.0)).stop);
  const ReflexDecision decision = loop.next(pressed(2.0));
  EXPECT_TRUE(decision.stop);
  EXPECT_TRUE(decision.force_present);
  EXPECT_NEAR(decision.force_N, 2.0, 1e-12);
  EXPECT_TRUE(loop.next(pressed(0.0)).stop);  // whoever let it stop must say that it may go on
  loop.reset();
  EXPECT_FALSE(loop.next(pressed(0.0)).stop);
}

TEST(ReflexLoop, StopsAboveAForceAndAfterFramesInARow) {
  ReflexLoop loop(known_model(), {.stop_above_N = 3.0, .stop_frames = 2});
  EXPECT_FALSE(loop.next(pressed(2.9)).stop);
  EXPECT_FALSE(loop.next(pressed(3.1)).stop);
  EXPECT_FALSE(loop.next(pressed(2.9)).stop);
  EXPECT_FALSE(loop.next(pressed(3.1)).stop);
  EXPECT_TRUE(loop.next(pressed(3.1)).stop);
}

TEST(ReflexLoop, ShearIsSummedWhileThereIsForce) {
  ReflexLoop loop(known_model(), {.stop_above_N = 100.0, .release_frames = 2});
  loop.next(pressed(0.0));
  loop.next(pressed(0.0));
  ChipStatistics moved = pressed(2.0);
  moved.dx = 3;
  moved.dy = -1;
  ReflexDecision decision;
  for (int i = 0; i < 10; ++i) decision = loop.next(moved);
  EXPECT_NEAR(decision.shear_N.x(), (0.01 + 0.001 * 2.0) * 30.0, 1e-12);
  EXPECT_NEAR(decision.shear_N.y(), -(0.01 + 0.001 * 2.0) * 10.0, 1e-12);
  EXPECT_EQ(loop.next(pressed(0.0)).shear_N.norm(), 0.0);
}

TEST(ReflexLoop, WhatCannotBeBelievedIsSaidAndStopsAfterAWhile) {
  const ChipStatistics dark{};
  ChipStatistics saturated{.maximum = 63, .minimum = 63, .squal = 0, .average = 62.8};
  ChipStatistics flat{.maximum = 31, .minimum = 30, .squal = 0, .average = 30.0};
  ChipStatistics blurred{.maximum = 40, .minimum = 10, .squal = 0, .average = 20.0};
  ChipStatistics disturbed = pressed(1.0);
  disturbed.maximum = 200;
  const std::vector<std::pair<ChipStatistics, ChipFault>> cases = {{dark, ChipFault::dark},
                                                                   {saturated, ChipFault::saturated},
                                                                   {flat, ChipFault::flat},
                                                                   {blurred, ChipFault::no_features},
                                                                   {disturbed, ChipFault::impossible}};
  for (const auto& [statistics, fault] : cases) {
    ReflexLoop loop(known_model(), {.stop_above_N = 100.0});
    const double before = loop.next(pressed(2.0)).force_N;
    const ReflexDecision first = loop.next(statistics);
    EXPECT_EQ(first.fault, fault) << name_of(fault);
    EXPECT_EQ(first.force_N, before);
    EXPECT_FALSE(first.stop);
    loop.next(statistics);
    EXPECT_TRUE(loop.next(statistics).stop) << name_of(fault);
    ReflexLoop trusting(known_model(), {.stop_above_N = 100.0, .stop_when_blind = false});
    for (int i = 0; i < 10; ++i) EXPECT_FALSE(trusting.next(statistics).stop);
    EXPECT_EQ(trusting.next(pressed(1.0)).fault, ChipFault::none);
  }
  EXPECT_EQ(name_of(ChipFault::none), "none");
}

TEST(ReflexLoop, WhatMakesNoSenseIsNamed) {
  const auto with = [](const ReflexSettings& settings) { return [settings] { ReflexLoop(known_model(), settings); }; };
  EXPECT_THAT(with({.stop_above_N = -1.0}), ThrowsMessage<Error>(HasSubstr("stop_above_N is -1")));
  EXPECT_THAT(with({.stop_frames = 0}), ThrowsMessage<Error>(HasSubstr("stop_frames is 0")));
  EXPECT_THAT(with({.release_frames = 0}), ThrowsMessage<Error>(HasSubstr("release_frames is 0")));
  EXPECT_THAT(with({.blind_frames = 0}), ThrowsMessage<Error>(HasSubstr("blind_frames is 0")));
  EXPECT_THAT([] { ReflexLoop({}, {}); }, ThrowsMessage<Error>(HasSubstr("no node")));
}

TEST(ReflexBudget, AddsUpToLessThanTheTextsTwoMilliseconds) {
  const ReflexBudget budget{.decision_us = 1.0};
  EXPECT_DOUBLE_EQ(budget.after_frame_us(), 433.0);
  EXPECT_NEAR(budget.mean_us(), 766.3, 0.1);
  EXPECT_NEAR(budget.most_us(), 1531.7, 0.1);
}

}  // namespace
}  // namespace touchstone::sensors
