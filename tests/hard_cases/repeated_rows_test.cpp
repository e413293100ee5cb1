// The hard case of fits that their samples don't determine, 43: rows that repeat each other, one class, one kind of
// row, columns that go together. What a good program does with it stands in script/hard_cases_page.py.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <string>
#include <vector>

#include "core/random.h"
#include "sensors/beads/stiffness_training.h"
#include "sensors/events/material_classifier.h"
#include "sensors/learning/bayesian_minimum.h"
#include "sensors/learning/gaussian_process.h"
#include "sensors/learning/gaussian_process_tuning.h"
#include "sensors/learning/levenberg_marquardt.h"
#include "sensors/learning/scaled_conjugate_gradient.h"
#include "sensors/markers/linear_force.h"
#include "sensors/reflex/press_law.h"
#include "sensors/reflex/shear_law.h"
#include "sensors/reflex/statistics_force.h"
#include "tests/hard_cases/hard_case.h"
#include "tests/support/message_of.h"

namespace touchstone::sensors {
namespace {

using test::did;
using test::message_of;
using test::refused;
using test::Worst;
using ::testing::HasSubstr;

Eigen::MatrixXd uniform(Eigen::Index rows, Eigen::Index columns, std::uint64_t index) {
  RandomStream random(43, index, Purpose::kTest);
  Eigen::MatrixXd all(rows, columns);
  for (double& value : all.reshaped()) value = random.uniform();
  return all;
}

// K rows that are all there k times are K rows with the means of their targets, known with a k-th of the variance.
TEST(HardCase43, RowsOfAGaussianProcessThatRepeatAreOneRowWithLessNoise) {
  constexpr Eigen::Index kRows = 12;
  constexpr Eigen::Index kTimes = 5;
  const Eigen::MatrixXd once = uniform(kRows, 2, 1);
  const Eigen::VectorXd targets = uniform(kRows * kTimes, 1, 2);
  Eigen::MatrixXd all(kRows * kTimes, 2);
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(kRows);
  for (Eigen::Index i = 0; i < all.rows(); ++i) {
    all.row(i) = once.row(i % kRows);
    mean[i % kRows] += targets[i] / kTimes;
  }
  const Eigen::MatrixXd places = uniform(40, 2, 3);
  // What is refused is said to be; of what isn't, one percent of the targets' range is the bar.
  Worst roughly{0.01};
  Worst closely{1e-8};
  std::string said;
  double least_taken = 1.0;
  for (int decade = 1; decade <= 12; ++decade) {
    const double noise = std::pow(10.0, -decade);
    const GaussianProcessParameters parameters{Eigen::Vector2d(0.4, 0.3), 1.0, noise};
    GaussianProcessParameters less = parameters;
    less.noise /= std::sqrt(static_cast<double>(kTimes));
    std::string refusal;
    try {
      const GaussianProcessPrediction found = predict_with_variance(condition(parameters, all, targets), places);
      const GaussianProcessPrediction wanted = predict_with_variance(condition(less, once, mean), places);
      const double away = std::max((found.mean - wanted.mean).cwiseAbs().maxCoeff(),
                                   (found.variance - wanted.variance).cwiseAbs().maxCoeff());
      EXPECT_LT(roughly(away), roughly.bar) << noise;
      if (decade <= 3) {
        EXPECT_LT(closely(away), closely.bar) << noise;
      }
      EXPECT_TRUE(said.empty()) << "less noise is taken than was refused: " << noise;
      least_taken = noise;
    } catch (const Error& error) {
      if (said.empty()) said = error.what();
      EXPECT_THAT(error.what(), HasSubstr("more noise is needed"));
    }
  }
  EXPECT_FALSE(said.empty());
  EXPECT_LE(least_taken, 1e-3);
  did("a Gaussian process of 12 rows, each 5 times with other targets: means and variances are those of 12 rows with a "
      "fifth of the noise's square, to {} with noise from 0.1 to 0.001 of the signal, to {} down to {:.0e}; then "
      "{}",
      closely.text(), roughly.text(), least_taken, refused(said));
}

TEST(HardCase43, AGaussianProcessOfOneKindOfRowKnowsItsMean) {
  const Eigen::MatrixXd rows = Eigen::MatrixXd::Constant(30, 2, 3.0);
  const Eigen::VectorXd targets = uniform(30, 1, 4);
  const Eigen::VectorXd same = Eigen::VectorXd::Constant(30, 0.7);
  Worst away{1e-8};
  int tunings = 0;
  for (const TuningMethod method : {TuningMethod::kBayesian, TuningMethod::kGradient}) {
    TuningSettings settings;
    settings.method = method;
    settings.aim = TuningAim::kEvidence;
    for (const Eigen::VectorXd& wanted : {targets, same}) {
      const TunedGaussianProcess tuned = tune_gaussian_process(rows, wanted, {}, {}, settings);
      const GaussianProcessPrediction here = predict_with_variance(tuned.process, rows.topRows(1));
      EXPECT_TRUE(std::isfinite(tuned.process.log_evidence));
      EXPECT_TRUE(std::isfinite(here.variance[0]) && here.variance[0] >= 0.0);
      EXPECT_LT(away(std::abs(here.mean[0] - wanted.mean())), away.bar);
      ++tunings;
    }
  }
  did("a Gaussian process tuned on 30 equal rows, with all kinds of targets and with one, by search and by gradient "
      "({} "
      "times): it gives the targets' mean to {}",
      tunings, away.text());
}

// From zero a conjugate gradient stays among the rows: it ends at the solution of least norm.
TEST(HardCase43, AConjugateGradientEndsAtTheLeastNorm) {
  Eigen::MatrixXd rows = uniform(9, 6, 5);
  rows.row(3) = rows.row(1);        // a row that repeats
  rows.col(4) = 2.0 * rows.col(0);  // columns that go together
  rows.col(5).setZero();            // a column without a word
  const Eigen::VectorXd wanted = uniform(9, 1, 6);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(6);
  ScaledConjugateGradientSettings settings;
  settings.least_gradient = 1e-13;
  const ScaledConjugateGradientEnd end = minimise_by_scaled_conjugate_gradient(
      [&](const Eigen::VectorXd& at, Eigen::VectorXd& gradient) {
        const Eigen::VectorXd error = rows * at - wanted;
        gradient = rows.transpose() * error;
        return 0.5 * error.squaredNorm();
      },
      x, settings);
  const Eigen::VectorXd least = Eigen::JacobiSVD<Eigen::MatrixXd>(rows, Eigen::ComputeThinU | Eigen::ComputeThinV)
                                    .setThreshold(1e-10)
                                    .solve(wanted);
  Worst away{1e-6};
  EXPECT_LT(away((x - least).cwiseAbs().maxCoeff()), away.bar);
  Eigen::VectorXd still = Eigen::VectorXd::Ones(3);
  const ScaledConjugateGradientEnd constant = minimise_by_scaled_conjugate_gradient(
      [](const Eigen::VectorXd&, Eigen::VectorXd& gradient) {
        gradient.setZero();
        return 1.0;
      },
      still);
  EXPECT_TRUE(constant.is_flat);
  EXPECT_EQ(still, Eigen::Vector3d::Ones());
  Eigen::VectorXd none;
  const std::string said =
      message_of([&] { minimise_by_scaled_conjugate_gradient([](const auto&, auto&) { return 0.0; }, none); });
  EXPECT_THAT(said, HasSubstr("nothing to vary"));
  did("a conjugate gradient on least squares of rank 4 in 6 unknowns ends after {} steps at the least-norm solution, "
      "to "
      "{}; a constant function leaves it where it began; no unknown at all is {}",
      end.steps, away.text(), refused(said));
}

std::vector<MaterialSample> equal_grasps(const std::vector<int>& labels) {
  std::vector<MaterialSample> samples;
  for (const int label : labels) samples.push_back({Eigen::Vector4d(10, 20, 30, 40), label});
  return samples;
}

std::vector<int> indices(std::size_t count) {
  std::vector<int> all(count);
  std::iota(all.begin(), all.end(), 0);
  return all;
}

TEST(HardCase43, AClassifierOfEqualGraspsGivesTheShareOfEachClass) {
  MaterialClassifierSettings settings;
  settings.hidden_layers = 1;
  settings.units = 6;
  const std::vector<MaterialSample> mixed = equal_grasps({0, 0, 0, 1});
  const MaterialClassifier model = train_material_classifier(mixed, {"foam", "steel"}, indices(4), {}, settings).model;
  const MaterialGuess guess = classify(model, mixed[0].features);
  Worst away{1e-4};
  EXPECT_LT(away((guess.probabilities - Eigen::Vector2d(0.75, 0.25)).cwiseAbs().maxCoeff()), away.bar);
  EXPECT_EQ(guess.label, 0);
  const std::vector<MaterialSample> one = equal_grasps({0, 0, 0});
  const std::string alone = message_of([&] { train_material_classifier(one, {"foam"}, indices(3), {}, settings); });
  EXPECT_THAT(alone, HasSubstr("at least 2 are needed"));
  const std::string missing = message_of([&] {
    train_material_classifier(one, {"foam", "steel"}, indices(3), {}, settings);
  });
  EXPECT_THAT(missing, HasSubstr("'steel'"));
  did("a classifier of 4 equal grasps, 3 of one material: probabilities 0.75 and 0.25 to {}; of one material alone it "
      "is {}; "
      "with a material that no grasp has it is {}",
      away.text(), refused(alone), refused(missing));
}

TEST(HardCase43, ANetworkOfOneKindOfRowLearnsItsMean) {
  NetworkSamples samples{Eigen::MatrixXd::Constant(3, 20, 0.3), uniform(1, 20, 7)};
  Worst away{1e-6};
  for (const StepForm form : {StepForm::kNormal, StepForm::kDual}) {
    RandomStream random(43, 8, Purpose::kTest);
    FeedForwardNetwork network =
        random_network({.inputs = 3, .hidden_layers = 1, .units = 5, .outputs = 1, .sigmoid = Sigmoid::kTanh}, random);
    LevenbergMarquardtSettings settings;
    settings.form = form;
    settings.most_steps = 100;
    train_by_levenberg_marquardt(network, samples, {Eigen::MatrixXd(3, 0), Eigen::MatrixXd(1, 0)}, settings);
    const double found = evaluate(network, samples.inputs.col(0))(0, 0);
    EXPECT_LT(away(std::abs(found - samples.targets.mean())), away.bar);
  }
  did("a network of 26 weights on 20 equal rows, by either form of Levenberg and Marquardt's step: the targets' mean "
      "to {}",
      away.text());
}

TEST(HardCase43, ABayesianSearchOfAConstantEnds) {
  const SearchBox box{Eigen::Vector2d(-1, 0), Eigen::Vector2d(1, 2)};
  const BayesianMinimum found =
      find_bayesian_minimum([](const Eigen::VectorXd&) { return 3.0; }, box, Eigen::Vector2d(0.0, 1.0));
  EXPECT_EQ(found.value, 3.0);
  for (const Eigen::VectorXd& place : found.places) {
    EXPECT_TRUE((place.array() >= box.low.array()).all() && (place.array() <= box.high.array()).all());
  }
  did("a Bayesian search of a function that is 3 everywhere: {} after {} places, all of them in the box", found.value,
      found.places.size());
}

std::string linear_refusal(const std::vector<double>& measure, const std::vector<double>& force_N, FitLine line) {
  return message_of([&] { fit_linear_force(measure, force_N, line); });
}

TEST(HardCase43, ALineOfOneMeasureIsRefused) {
  const std::vector<double> forces = {1.0, 2.0, 4.0, 5.0};
  const std::string equal = linear_refusal({2, 2, 2, 2}, forces, FitLine::kFree);
  EXPECT_THAT(equal, HasSubstr("all measures are 2"));
  // What rounding makes of 0.3: a line through these would have a slope of 1e16 N.
  const double sum = 0.1 + 0.2;
  ASSERT_NE(sum, 0.3);
  for (const FitLine line : {FitLine::kFree, FitLine::kThroughOrigin}) {
    EXPECT_THAT(linear_refusal({0.3, sum, 0.3, sum}, forces, line), HasSubstr("all measures are 0.3"));
  }
  EXPECT_THAT(linear_refusal({1, 2, 3, 4}, {sum, 0.3, 0.3, sum}, FitLine::kFree), HasSubstr("all forces are"));
  // Repeats that leave two measures are a line through their means.
  const LinearForce fit = fit_linear_force(std::vector<double>{1, 1, 3, 3}, forces, FitLine::kFree);
  Worst away{1e-14};
  EXPECT_LT(away(std::abs(fit.newton_per_unit - 1.5) + std::abs(fit.offset_N)), away.bar);
  did("a line of force through measures that are all 2, or 0.3 and 0.1 + 0.2, is {}; of two measures that repeat it "
      "goes "
      "through the means, to {}",
      refused(equal), away.text());
}

TEST(HardCase43, LawsOfAPressThatOnePressCantGiveAreRefused) {
  const std::vector<DilationSample> one_dilation(9, {1.1, 1.0});
  EXPECT_EQ(message_of([&] { fit_dilation_press(one_dilation, 1); }), "no error");
  const std::string dilation = message_of([&] { fit_dilation_press(one_dilation, 2); });
  EXPECT_THAT(dilation, HasSubstr("too few different ones"));
  EXPECT_THAT(message_of([&] {
                fit_dilation_press(std::vector<DilationSample>(9, {1.0, 1.0}), 1);
              }),
              HasSubstr("too few different ones"));
  // Any rate fits one press: which is taken would be rounding's choice.
  std::string exponential;
  for (const double press_mm : {0.1, 0.5, 1.0, 3.7}) {
    for (const double spread : {0.0, 0.3}) {
      std::vector<PressSample> samples;
      for (int i = 0; i < 6; ++i) samples.push_back({press_mm, 1.0 + spread * i});
      exponential = message_of([&] { fit_exponential_force(samples); });
      EXPECT_THAT(exponential, HasSubstr("two different ones are needed")) << press_mm << " " << spread;
    }
  }
  EXPECT_THAT(message_of([&] {
                fit_exponential_force(std::vector<PressSample>(6, {-1.0, 0.0}));
              }),
              HasSubstr("no press is above 0 mm"));
  std::vector<ShearSample> along_one_line;
  for (int i = 0; i < 12; ++i) along_one_line.push_back({{0.1 * i, 0.2 * i}, 1.0 + i % 3, {1.0, 2.0}});
  const std::string shear = message_of([&] { fit_shear_law(along_one_line); });
  EXPECT_THAT(shear, HasSubstr("along one line"));
  did("a dilation law of two terms from one dilation is {}\nan exponential law from one press is {}\na shear law from "
      "displacements along one line is {}",
      refused(dilation), refused(exponential), refused(shear));
}

// Of equal rows t c = F with the least c in units of the columns' sizes: each term bears its share.
TEST(HardCase43, AForceOfStatisticsTakesTheSmallestCoefficients) {
  const ChipStatistics one{.maximum = 40, .minimum = 8, .squal = 90, .average = 20.5};
  Worst away{1e-12};
  for (const int degree : {1, 2}) {
    const auto terms = degree == 1 ? 5 : static_cast<int>(kStatisticsTerms);
    std::vector<StatisticsForceSample> samples;
    for (int i = 0; i < 40; ++i) samples.push_back({one, i % 2 == 0 ? 1.0 : 2.0});
    const StatisticsForce model = fit_statistics_force(samples, degree);
    const auto values = statistics_terms(one);
    for (int k = 0; k < terms; ++k) {
      const double share = values[static_cast<std::size_t>(k)] * model.coefficients[static_cast<std::size_t>(k)];
      EXPECT_LT(away(std::abs(share - 1.5 / terms)), away.bar) << k;
    }
    EXPECT_LT(away(std::abs(model.force_N(one) - 1.5)), away.bar);
  }
  did("a force of chip statistics from 40 equal frames, half of 1 N and half of 2 N: 1.5 N, each term bearing the same "
      "share, to {}",
      away.text("N"));
}

TEST(HardCase43, AStiffnessModelOfOnePressGivesItsMeanForce) {
  ForceSamples samples;
  samples.grid = 3;
  for (int i = 0; i < 9; ++i) samples.rest.emplace_back(100.0 * (i % 3), 100.0 * (i / 3));
  std::vector<Eigen::Vector2d> pressed = samples.rest;
  for (int i = 0; i < 9; ++i) pressed[static_cast<std::size_t>(i)] += Eigen::Vector2d(1.0 + 0.3 * i, 2.0 - 0.2 * i);
  for (int i = 0; i < 6; ++i) {
    samples.positions.push_back(pressed);
    samples.forces.emplace_back(0.1, -0.2, i % 2 == 0 ? 1.0 : 3.0);
  }
  const TrainedModel trained = train(samples, TrainingSettings::to_convergence());
  TrackedBeads beads;
  beads.positions = pressed;
  beads.status.assign(9, BeadStatus::kFound);
  const Eigen::Vector3d found = estimate(trained.model, beads).force;
  Worst away{1e-5};
  EXPECT_LT(away((found - Eigen::Vector3d(0.1, -0.2, 2.0)).cwiseAbs().maxCoeff()), away.bar);
  const std::string said = message_of([&] {
    ForceSamples still = samples;
    for (auto& one : still.positions) one = still.rest;
    train(still, TrainingSettings::to_convergence());
  });
  EXPECT_THAT(said, HasSubstr("no bead moves"));
  did("a stiffness model trained on one press six times, half of 1 N and half of 3 N: 2 N to {}; on beads that never "
      "move it is {}",
      away.text("N"), refused(said));
}

}  // namespace
}  // namespace touchstone::sensors
