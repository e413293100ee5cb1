#include "sensors/learning/gaussian_process.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/random.h"
#include "tests/support/message_of.h"

namespace touchstone::sensors {
namespace {

using test::message_of;
using testing::HasSubstr;

TEST(GaussianProcess, OfTwoSamplesIsTheClosedForm) {
  // One input, length 1: k12 = s^2 exp(-1/2). K = [a b; b a], a = s^2 + n^2; targets +-1 about their mean, which is an
  // eigenvector with the value a - b. So weights are +-1 / (a - b), and the evidence follows.
  const double s2 = 2.25;
  const double n2 = 0.04;
  const double a = s2 + n2;
  const double b = s2 * std::exp(-0.5);
  const GaussianProcess process =
      condition({Eigen::VectorXd::Ones(1), 1.5, 0.2}, Eigen::Vector2d(0.0, 1.0), Eigen::Vector2d(6.0, 4.0));
  EXPECT_DOUBLE_EQ(process.mean, 5.0);
  EXPECT_NEAR(process.weights[0], 1.0 / (a - b), 1e-14);
  EXPECT_NEAR(process.weights[1], -1.0 / (a - b), 1e-14);
  EXPECT_NEAR(process.log_evidence, -1.0 / (a - b) - 0.5 * std::log(a * a - b * b) - std::log(2.0 * std::numbers::pi),
              1e-13);
  // Midway between: both samples weigh the same, so the mean is theirs; far away it is the prior's.
  const GaussianProcessPrediction at = predict_with_variance(process, Eigen::Vector2d(0.5, 100.0));
  EXPECT_NEAR(at.mean[0], 5.0, 1e-14);
  EXPECT_NEAR(at.mean[1], 5.0, 1e-14);
  const double k = s2 * std::exp(-0.125);
  EXPECT_NEAR(at.variance[0], s2 - 2.0 * k * k / (a + b), 1e-13);
  EXPECT_NEAR(at.variance[1], s2, 1e-13);
}

// scikit-learn 1.2.1: GaussianProcessRegressor(ConstantKernel(1.5**2) * RBF([0.7, 1.3]) + WhiteKernel(0.2**2),
// optimizer=None, alpha=0) on targets less their mean; variances less the white kernel's. Its gradients are by log
// signal^2 and log noise^2: half of ours.
TEST(GaussianProcess, GivesScikitLearnsNumbersForThreeSamples) {
  const Eigen::MatrixXd inputs = (Eigen::MatrixXd(3, 2) << 0.0, 0.0, 1.0, 0.5, 0.3, 2.0).finished();
  const GaussianProcess process =
      condition({Eigen::Vector2d(0.7, 1.3), 1.5, 0.2}, inputs, Eigen::Vector3d(1.0, 2.0, 0.5));
  EXPECT_NEAR(process.log_evidence, -4.2482394933073095, 1e-12);
  const Eigen::VectorXd gradient = evidence_gradient(process);
  EXPECT_NEAR(gradient[0], 0.04594178, 1e-8);
  EXPECT_NEAR(gradient[1], 0.13963453, 1e-8);
  EXPECT_NEAR(gradient[2], 2.0 * -1.10492884, 2e-8);
  EXPECT_NEAR(gradient[3], 2.0 * -0.02095039, 2e-8);
  const auto at = predict_with_variance(process, (Eigen::MatrixXd(2, 2) << 0.5, 1.0, 3.0, 3.0).finished());
  EXPECT_NEAR(at.mean[0], 1.1882878699339883, 1e-12);
  EXPECT_NEAR(at.mean[1], 1.1694577903928187, 1e-12);
  EXPECT_NEAR(at.variance[0], 0.3558903242509809, 1e-12);
  EXPECT_NEAR(at.variance[1], 2.2499824286702856, 1e-12);
}

struct Samples {
  Eigen::MatrixXd inputs;
  Eigen::VectorXd targets;
};

Samples forty() {
  Samples samples{Eigen::MatrixXd(40, 3), Eigen::VectorXd(40)};
  for (int i = 0; i < 40; ++i) {
    samples.inputs.row(i) << std::sin(1.7 * i), std::cos(0.9 * i + 1.0), i / 40.0;
    samples.targets[i] =
        std::sin(2.0 * samples.inputs(i, 0)) + samples.inputs(i, 1) * samples.inputs(i, 2) + 0.05 * std::cos(37.0 * i);
  }
  return samples;
}

// scikit-learn 1.2.1, as above: signal 0.9, lengths 0.8, 1.1, 0.6, noise 0.1.
TEST(GaussianProcess, GivesScikitLearnsNumbersForFortySamples) {
  const Samples samples = forty();
  const GaussianProcess process =
      condition({Eigen::Vector3d(0.8, 1.1, 0.6), 0.9, 0.1}, samples.inputs, samples.targets);
  EXPECT_NEAR(process.log_evidence, 5.643130010321471, 1e-10);
  const Eigen::VectorXd gradient = evidence_gradient(process);
  EXPECT_NEAR(gradient[0], 11.96399973, 1e-7);
  EXPECT_NEAR(gradient[1], 11.6355884, 1e-7);
  EXPECT_NEAR(gradient[2], 13.24024272, 1e-7);
  EXPECT_NEAR(gradient[3], 2.0 * -7.27142556, 1e-7);
  EXPECT_NEAR(gradient[4], 2.0 * -6.50886481, 1e-7);
  const auto at = predict_with_variance(process, Eigen::RowVector3d(0.1, -0.2, 0.5));
  EXPECT_NEAR(at.mean[0], 0.07318569685178636, 1e-11);
  EXPECT_NEAR(at.variance[0], 0.00748002731646836, 1e-11);
}

TEST(GaussianProcess, TheGradientIsThatOfDifferences) {
  // 130 samples, so that the blocks of the factor have borders.
  Samples samples{Eigen::MatrixXd(130, 2), Eigen::VectorXd(130)};
  RandomStream random(1, 0, Purpose::kTest);
  for (int i = 0; i < 130; ++i) {
    samples.inputs.row(i) << 3.0 * random.uniform(), random.normal();
    samples.targets[i] = std::sin(samples.inputs(i, 0)) + 0.3 * samples.inputs(i, 1) + 0.1 * random.normal();
  }
  const GaussianProcessParameters parameters{Eigen::Vector2d(0.9, 2.0), 1.2, 0.15};
  const Eigen::VectorXd gradient = evidence_gradient(condition(parameters, samples.inputs, samples.targets));
  for (Eigen::Index i = 0; i < 4; ++i) {
    const auto evidence = [&](double step) {
      Eigen::VectorXd logarithms = parameters.logarithms();
      logarithms[i] += step;
      return condition(GaussianProcessParameters::from_logarithms(logarithms), samples.inputs, samples.targets)
          .log_evidence;
    };
    EXPECT_NEAR(gradient[i], (evidence(1e-5) - evidence(-1e-5)) / 2e-5, 1e-5 * std::max(1.0, std::abs(gradient[i])))
        << i;
  }
}

TEST(GaussianProcess, TheBestSignalIsThatWhereTheEvidenceIsFlat) {
  const Samples samples = forty();
  const GaussianProcess process =
      with_best_signal(condition({Eigen::Vector3d(0.8, 1.1, 0.6), 3.0, 0.3}, samples.inputs, samples.targets));
  EXPECT_NEAR(process.parameters.signal / process.parameters.noise, 10.0, 1e-12);
  // The derivative along both standard deviations together.
  const Eigen::VectorXd gradient = evidence_gradient(process);
  EXPECT_NEAR(gradient[3] + gradient[4], 0.0, 1e-8);
  // It is the process that its parameters would have given.
  const GaussianProcess again = condition(process.parameters, samples.inputs, samples.targets);
  EXPECT_NEAR(again.log_evidence, process.log_evidence, 1e-9);
  EXPECT_LT((again.weights - process.weights).norm(), 1e-9 * again.weights.norm());
  EXPECT_LT((again.factor - process.factor).norm(), 1e-12 * again.factor.norm());
  const GaussianProcess flat =
      with_best_signal(condition({Eigen::VectorXd::Ones(1), 1.0, 0.1}, Eigen::Vector2d(0, 1), Eigen::Vector2d(2, 2)));
  EXPECT_EQ(flat.parameters.signal, 1.0);
}

TEST(GaussianProcess, FaultyInputIsNamed) {
  const auto message = [](auto spoil) {
    Samples samples = forty();
    GaussianProcessParameters parameters{Eigen::Vector3d(0.8, 1.1, 0.6), 0.9, 0.1};
    spoil(parameters, samples);
    return message_of([&] { condition(parameters, samples.inputs, samples.targets); });
  };
  EXPECT_EQ(message([](auto&, auto&) {}), "no error");
  EXPECT_THAT(message([](auto&, auto& s) { s.inputs.resize(0, 3); }), HasSubstr("0 samples"));
  EXPECT_THAT(message([](auto&, auto& s) { s.inputs.setZero(20'001, 3); }), HasSubstr("at most 20000"));
  EXPECT_THAT(message([](auto&, auto& s) { s.targets.setZero(39); }), HasSubstr("40 samples have 39 targets"));
  EXPECT_THAT(message([](auto&, auto& s) { s.inputs(3, 1) = std::nan(""); }), HasSubstr("an input isn't finite"));
  EXPECT_THAT(message([](auto&, auto& s) { s.targets[3] = INFINITY; }), HasSubstr("a target isn't finite"));
  EXPECT_THAT(message([](auto& p, auto&) { p.lengths = Eigen::Vector2d(1, 1); }), HasSubstr("2 lengths for 3 inputs"));
  EXPECT_THAT(message([](auto& p, auto&) { p.lengths[1] = 0.0; }), HasSubstr("a length is 0"));
  EXPECT_THAT(message([](auto& p, auto&) { p.signal = -1.0; }), HasSubstr("signal is -1"));
  EXPECT_THAT(message([](auto& p, auto&) { p.noise = std::nan(""); }), HasSubstr("noise is nan"));
  EXPECT_THAT(message([](auto& p, auto& s) {
                p.noise = 1e-300;
                s.inputs.setZero();
              }),
              HasSubstr("more noise"));
  const Samples samples = forty();
  const GaussianProcess process =
      condition({Eigen::Vector3d(0.8, 1.1, 0.6), 0.9, 0.1}, samples.inputs, samples.targets);
  EXPECT_THAT(message_of([&] { predict(process, Eigen::MatrixXd::Zero(1, 2)); }), HasSubstr("places have 2 inputs"));
  EXPECT_THAT(message_of([&] { predict(process, Eigen::MatrixXd::Constant(1, 3, std::nan(""))); }),
              HasSubstr("isn't finite"));
}

}  // namespace
}  // namespace touchstone::sensors
