#include "sensors/learning/gaussian_process_tuning.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "core/random.h"
#include "sensors/learning/bayesian_minimum.h"
#include "tests/support/message_of.h"

namespace touchstone::sensors {
namespace {

using test::message_of;
using testing::HasSubstr;

const auto kBowl = [](const Eigen::VectorXd& x) { return (x - Eigen::Vector2d(0.3, -1.0)).squaredNorm(); };
const SearchBox kBox{Eigen::Vector2d(-2.0, -3.0), Eigen::Vector2d(2.0, 3.0)};

TEST(BayesianMinimum, FindsABowlsBottomInFifteenEvaluations) {
  // Fifteen random places in this box of 24 come within 0.16 of the squared distance at the bottom half the time (24 *
  // 0.046 / 2 pi); the search has to be ten times better, for each of ten seeds.
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    BayesianMinimumSettings settings;
    settings.evaluations = 15;
    settings.seed = seed;
    const BayesianMinimum found = find_bayesian_minimum(kBowl, kBox, Eigen::Vector2d(1.5, 2.0), settings);
    EXPECT_LT(found.value, 0.016) << seed;
    EXPECT_EQ(found.values.size(), 15U);
    EXPECT_EQ(found.places.front(), Eigen::Vector2d(1.5, 2.0));
    EXPECT_EQ(found.value, kBowl(found.place));
    for (const Eigen::VectorXd& place : found.places) {
      EXPECT_TRUE((place.array() >= kBox.low.array()).all() && (place.array() <= kBox.high.array()).all());
    }
  }
}

TEST(BayesianMinimum, TheSeedDecides) {
  const Eigen::Vector2d first(1.5, 2.0);
  const BayesianMinimum one = find_bayesian_minimum(kBowl, kBox, first);
  EXPECT_EQ(find_bayesian_minimum(kBowl, kBox, first).places, one.places);
  EXPECT_NE(find_bayesian_minimum(kBowl, kBox, first, {.seed = 2}).places, one.places);
  EXPECT_NE(find_bayesian_minimum(kBowl, kBox, first, {.stream = 1}).places, one.places);
}

TEST(BayesianMinimum, PlacesWithoutAValueAreAvoided) {
  const auto half = [](const Eigen::VectorXd& x) { return x[0] > 0.0 ? kBowl(x) : std::nan(""); };
  const BayesianMinimum found = find_bayesian_minimum(half, kBox, Eigen::Vector2d(-1.5, 2.0), {.evaluations = 20});
  EXPECT_LT(found.value, 0.1);
  EXPECT_THAT(message_of([] {
                find_bayesian_minimum([](const Eigen::VectorXd&) { return INFINITY; }, kBox, Eigen::Vector2d(0, 0));
              }),
              HasSubstr("finite at none of 10"));
  const BayesianMinimum flat =
      find_bayesian_minimum([](const Eigen::VectorXd&) { return 3.0; }, kBox, Eigen::Vector2d(0, 0));
  EXPECT_EQ(flat.value, 3.0);
}

TEST(BayesianMinimum, FaultyInputIsNamed) {
  const auto message = [](const SearchBox& box, const Eigen::VectorXd& first,
                          const BayesianMinimumSettings& settings = {}) {
    return message_of([&] { find_bayesian_minimum(kBowl, box, first, settings); });
  };
  const Eigen::Vector2d origin(0.0, 0.0);
  EXPECT_THAT(message({Eigen::Vector2d(0, 0), Eigen::Vector3d(1, 1, 1)}, origin), HasSubstr("2 and 3 coordinates"));
  EXPECT_THAT(message({{}, {}}, {}), HasSubstr("at least 1"));
  EXPECT_THAT(message({Eigen::Vector2d(0, 1), Eigen::Vector2d(1, 1)}, origin), HasSubstr("from 1 to 1 along 1"));
  EXPECT_THAT(message(kBox, Eigen::Vector2d(0.0, 4.0)), HasSubstr("at 4 along 1"));
  EXPECT_THAT(message(kBox, origin, {.first_evaluations = 1}), HasSubstr("first_evaluations is 1"));
  EXPECT_THAT(message(kBox, origin, {.evaluations = 3}), HasSubstr("evaluations is 3"));
  EXPECT_THAT(message(kBox, origin, {.candidates = 0}), HasSubstr("candidates is 0"));
}

struct Drawn {
  Eigen::MatrixXd inputs;
  Eigen::VectorXd targets;
};

/// A function drawn from the kernel itself, with noise: inputs of quite different units.
Drawn draw(int count, const GaussianProcessParameters& truth, std::uint64_t seed) {
  RandomStream random(seed, 0, Purpose::kTest);
  Drawn drawn{Eigen::MatrixXd(count, 2), Eigen::VectorXd(count)};
  for (int i = 0; i < count; ++i) drawn.inputs.row(i) << 1000.0 * random.uniform(), random.uniform();
  Eigen::MatrixXd covariance(count, count);
  for (int i = 0; i < count; ++i) {
    for (int j = 0; j < count; ++j) {
      const Eigen::Vector2d offset =
          (drawn.inputs.row(i) - drawn.inputs.row(j)).transpose().cwiseQuotient(truth.lengths);
      covariance(i, j) = truth.signal * truth.signal * std::exp(-0.5 * offset.squaredNorm()) +
                         (i == j ? truth.noise * truth.noise : 0.0);
    }
  }
  const Eigen::MatrixXd factor = covariance.llt().matrixL();
  Eigen::VectorXd normal(count);
  for (double& value : normal) value = random.normal();
  drawn.targets = (factor * normal).array() + 5.0;
  return drawn;
}

TEST(GaussianProcessTuning, TheEvidenceFindsTheParametersThatDataWereDrawnWith) {
  // The evidence's own curvature says how well 300 samples tell them: some 10 % for lengths and noise, 20 to 30 % for
  // the signal (the square holds few lengths). Three standard deviations of that.
  const GaussianProcessParameters truth{Eigen::Vector2d(150.0, 0.3), 2.0, 0.1};
  const Drawn drawn = draw(300, truth, 1);
  TuningSettings settings;
  settings.method = TuningMethod::kGradient;
  settings.aim = TuningAim::kEvidence;
  settings.gradient_steps = 60;
  const TunedGaussianProcess tuned = tune_gaussian_process(drawn.inputs, drawn.targets, {}, {}, settings);
  const GaussianProcessParameters& found = tuned.process.parameters;
  EXPECT_NEAR(std::log(found.lengths[0] / truth.lengths[0]), 0.0, 0.3);
  EXPECT_NEAR(std::log(found.lengths[1] / truth.lengths[1]), 0.0, 0.3);
  EXPECT_NEAR(std::log(found.signal / truth.signal), 0.0, 0.9);
  EXPECT_NEAR(std::log(found.noise / truth.noise), 0.0, 0.3);
  EXPECT_GE(tuned.process.log_evidence, condition(truth, drawn.inputs, drawn.targets).log_evidence);
  EXPECT_LT(evidence_gradient(tuned.process).cwiseAbs().maxCoeff(), 0.1);
}

TEST(GaussianProcessTuning, TenEvaluationsComeNearTheGradientsEvidence) {
  const Drawn drawn = draw(150, {Eigen::Vector2d(150.0, 0.3), 2.0, 0.1}, 2);
  TuningSettings settings;
  settings.aim = TuningAim::kEvidence;
  const TunedGaussianProcess bayesian = tune_gaussian_process(drawn.inputs, drawn.targets, {}, {}, settings);
  ASSERT_EQ(bayesian.values.size(), 10U);
  // At least as good as the first guess; the gradient, which has the slopes too, is better still.
  EXPECT_LE(-bayesian.process.log_evidence / 150.0, bayesian.values.front());
  settings.method = TuningMethod::kGradient;
  const TunedGaussianProcess gradient = tune_gaussian_process(drawn.inputs, drawn.targets, {}, {}, settings);
  EXPECT_GT(gradient.process.log_evidence, bayesian.process.log_evidence);
}

TEST(GaussianProcessTuning, TheValidationErrorIsMadeSmall) {
  const GaussianProcessParameters truth{Eigen::Vector2d(150.0, 0.3), 2.0, 0.1};
  const Drawn all = draw(260, truth, 3);
  const Eigen::MatrixXd inputs = all.inputs.topRows(200);
  const Eigen::VectorXd targets = all.targets.head(200);
  const Eigen::MatrixXd kept = all.inputs.bottomRows(60);
  const Eigen::VectorXd kept_targets = all.targets.tail(60);
  const TunedGaussianProcess tuned = tune_gaussian_process(inputs, targets, kept, kept_targets, {});
  const double error = (predict(tuned.process, kept) - kept_targets).squaredNorm() / 60.0;
  EXPECT_NEAR(error, *std::min_element(tuned.values.begin(), tuned.values.end()), 1e-12);
  EXPECT_EQ(tuned.samples_used, 200);
  // The process that drew the data has no systematic error: what is found isn't half as far off again.
  const double best = (predict(condition(truth, inputs, targets), kept) - kept_targets).squaredNorm() / 60.0;
  EXPECT_LT(error, 1.5 * best);
}

TEST(GaussianProcessTuning, ASubsetTunesAndAllAreUsed) {
  const Drawn drawn = draw(120, {Eigen::Vector2d(150.0, 0.3), 2.0, 0.1}, 4);
  TuningSettings settings;
  settings.aim = TuningAim::kEvidence;
  settings.most_samples = 50;
  const TunedGaussianProcess tuned = tune_gaussian_process(drawn.inputs, drawn.targets, {}, {}, settings, 3);
  EXPECT_EQ(tuned.samples_used, 50);
  EXPECT_EQ(tuned.process.targets.size(), 120);
  const TunedGaussianProcess again = tune_gaussian_process(drawn.inputs, drawn.targets, {}, {}, settings, 3);
  EXPECT_EQ(again.process.weights, tuned.process.weights);
  const TunedGaussianProcess other = tune_gaussian_process(drawn.inputs, drawn.targets, {}, {}, settings, 4);
  EXPECT_NE(other.process.weights, tuned.process.weights);
}

TEST(GaussianProcessTuning, TheSearchSkipsWhereTheNoiseIsTooSmallToFactorise) {
  // Each sample stands twice: with a noise of 1e-9 of the signal the covariance isn't positive definite in doubles.
  const Drawn once = draw(100, {Eigen::Vector2d(150.0, 0.3), 2.0, 0.1}, 6);
  Eigen::MatrixXd inputs(200, once.inputs.cols());
  inputs << once.inputs, once.inputs;
  Eigen::VectorXd targets(200);
  targets << once.targets, once.targets;
  TuningSettings settings;
  settings.aim = TuningAim::kEvidence;
  settings.least_noise_ratio = 1e-9;
  settings.evaluations = 40;
  const TunedGaussianProcess tuned = tune_gaussian_process(inputs, targets, {}, {}, settings);
  EXPECT_TRUE(tuned.process.weights.allFinite());
  EXPECT_EQ(tuned.values.size(), 40U);
}

TEST(GaussianProcessTuning, WhatNeverChangesDoesNoHarm) {
  Drawn drawn = draw(40, {Eigen::Vector2d(150.0, 0.3), 2.0, 0.1}, 5);
  drawn.inputs.col(1).setConstant(7.0);
  TuningSettings settings;
  settings.aim = TuningAim::kEvidence;
  EXPECT_TRUE(tune_gaussian_process(drawn.inputs, drawn.targets, {}, {}, settings).process.weights.allFinite());
  drawn.targets.setConstant(1.0);
  const GaussianProcess flat = tune_gaussian_process(drawn.inputs, drawn.targets, {}, {}, settings).process;
  EXPECT_NEAR(predict(flat, drawn.inputs.topRows(1))[0], 1.0, 1e-12);
}

TEST(GaussianProcessTuning, FaultyInputIsNamed) {
  const auto message = [](auto spoil) {
    Drawn drawn{Eigen::MatrixXd::Random(20, 2), Eigen::VectorXd::Random(20)};
    Drawn kept{Eigen::MatrixXd::Random(5, 2), Eigen::VectorXd::Random(5)};
    TuningSettings settings;
    int fold = 0;
    spoil(drawn, kept, settings, fold);
    return message_of(
        [&] { tune_gaussian_process(drawn.inputs, drawn.targets, kept.inputs, kept.targets, settings, fold); });
  };
  EXPECT_EQ(message([](auto&...) {}), "no error");
  EXPECT_THAT(message([](auto&, auto&, auto& s, auto&) { s.evaluations = 3; }), HasSubstr("evaluations is 3"));
  EXPECT_THAT(message([](auto&, auto&, auto& s, auto&) { s.gradient_steps = 0; }), HasSubstr("gradient_steps is 0"));
  EXPECT_THAT(message([](auto&, auto&, auto& s, auto&) { s.most_samples = 9; }), HasSubstr("most_samples is 9"));
  EXPECT_THAT(message([](auto&, auto&, auto& s, auto&) { s.longest = 1.0; }), HasSubstr("longest is 1"));
  EXPECT_THAT(message([](auto&, auto&, auto& s, auto&) { s.least_noise_ratio = 0.5; }), HasSubstr("least_noise_ratio"));
  EXPECT_THAT(message([](auto&, auto&, auto& s, auto&) { s.method = TuningMethod::kGradient; }),
              HasSubstr("only the evidence"));
  EXPECT_THAT(message([](auto&, auto&, auto&, auto& fold) { fold = -1; }), HasSubstr("fold is -1"));
  EXPECT_THAT(message([](auto& d, auto&, auto&, auto&) { d.targets.setZero(19); }), HasSubstr("20 samples and 19"));
  EXPECT_THAT(message([](auto& d, auto&, auto&, auto&) { d.inputs(2, 1) = std::nan(""); }), HasSubstr("finite"));
  EXPECT_THAT(message([](auto&, auto& k, auto&, auto&) { k = {}; }), HasSubstr("without validation samples"));
  EXPECT_THAT(message([](auto&, auto& k, auto&, auto&) { k.inputs.setZero(5, 3); }), HasSubstr("of 3 inputs"));
  EXPECT_STREQ(name_of(TuningMethod::kBayesian), "bayesian");
  EXPECT_STREQ(name_of(TuningAim::kValidation), "validation");
}

}  // namespace
}  // namespace touchstone::sensors
