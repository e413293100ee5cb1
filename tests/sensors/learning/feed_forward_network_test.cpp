#include "sensors/learning/feed_forward_network.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "sensors/learning/early_stopping.h"
#include "sensors/learning/range_scaling.h"
#include "tests/support/message_of.h"

namespace touchstone::sensors {
namespace {

using test::message_of;
using testing::HasSubstr;

FeedForwardNetwork network_of(const NetworkShape& shape, std::uint64_t seed = 1) {
  RandomStream random(seed, 0, Purpose::kTest);
  FeedForwardNetwork network = random_network(shape, random);
  for (Eigen::VectorXd& biases : network.biases) {
    for (double& bias : biases) bias = random.normal();
  }
  return network;
}

TEST(FeedForwardNetwork, OfOneUnitIsTheFormula) {
  FeedForwardNetwork network;
  network.weights = {Eigen::RowVector2d(0.5, -2.0), Eigen::MatrixXd::Constant(1, 1, 3.0)};
  network.biases = {Eigen::VectorXd::Constant(1, 0.25), Eigen::VectorXd::Constant(1, -1.0)};
  const Eigen::Vector2d inputs(1.5, 0.3);
  const double sum = 0.75 - 0.6 + 0.25;
  EXPECT_DOUBLE_EQ(evaluate(network, inputs)(0, 0), 3.0 * std::tanh(sum) - 1.0);
  network.sigmoid = Sigmoid::kLogistic;
  EXPECT_DOUBLE_EQ(evaluate(network, inputs)(0, 0), 3.0 / (1.0 + std::exp(-sum)) - 1.0);
  EXPECT_EQ(network.parameters(), 5);
}

TEST(FeedForwardNetwork, BothSigmoidsAreTheSameFunctionsWithOtherWeights) {
  // 1 / (1 + exp(-x)) = (1 + tanh(x / 2)) / 2.
  const FeedForwardNetwork logistic =
      network_of({.inputs = 3, .hidden_layers = 2, .units = 5, .sigmoid = Sigmoid::kLogistic});
  FeedForwardNetwork tanh = logistic;
  tanh.sigmoid = Sigmoid::kTanh;
  for (std::size_t i = 0; i < 3; ++i) {
    const double in = i == 0 ? 1.0 : 0.5;   // what comes in is (1 + t) / 2
    const double out = i == 2 ? 1.0 : 0.5;  // what is asked of tanh is half the sum
    if (i > 0) tanh.biases[i] += 0.5 * logistic.weights[i].rowwise().sum();
    tanh.weights[i] *= in * out;
    tanh.biases[i] *= out;
  }
  const Eigen::MatrixXd inputs = Eigen::MatrixXd::Random(3, 10);
  EXPECT_LT((evaluate(tanh, inputs) - evaluate(logistic, inputs)).cwiseAbs().maxCoeff(), 1e-13);
}

TEST(FeedForwardNetwork, DerivativesAreThoseOfDifferences) {
  for (const Sigmoid sigmoid : {Sigmoid::kTanh, Sigmoid::kLogistic}) {
    FeedForwardNetwork network =
        network_of({.inputs = 3, .hidden_layers = 3, .units = 4, .outputs = 2, .sigmoid = sigmoid});
    const Eigen::MatrixXd inputs = Eigen::MatrixXd::Random(3, 6);
    const Eigen::MatrixXd factors = Eigen::MatrixXd::Random(2, 6);  // of the sum that is derived
    const LayerValues values = run_forward(network, inputs);
    const Eigen::VectorXd gradient = sum_gradient(values, run_backward(network, values, factors));
    const Eigen::VectorXd at = parameters_of(network);
    ASSERT_EQ(gradient.size(), at.size());
    for (Eigen::Index i = 0; i < at.size(); ++i) {
      constexpr double kStep = 1e-5;
      const auto sum = [&](double step) {
        Eigen::VectorXd moved = at;
        moved[i] += step;
        set_parameters(network, moved);
        return evaluate(network, inputs).cwiseProduct(factors).sum();
      };
      EXPECT_NEAR(gradient[i], (sum(kStep) - sum(-kStep)) / (2.0 * kStep), 1e-8) << i;
    }
  }
}

TEST(FeedForwardNetwork, TheRunnerGivesTheSame) {
  const FeedForwardNetwork network = network_of({.inputs = 6, .hidden_layers = 4, .units = 40});
  NetworkRunner runner(network);
  const Eigen::MatrixXd inputs = Eigen::MatrixXd::Random(6, 20);
  const Eigen::MatrixXd outputs = evaluate(network, inputs);
  for (Eigen::Index i = 0; i < 20; ++i) {
    EXPECT_NEAR(runner.run(network, inputs.col(i))[0], outputs(0, i), 1e-13);
  }
}

TEST(FeedForwardNetwork, FirstWeightsAreWithinTheirLimitAndDependOnTheStream) {
  RandomStream random(1, 0, Purpose::kTest);
  const FeedForwardNetwork network =
      random_network({.inputs = 6, .hidden_layers = 2, .units = 50, .outputs = 3}, random);
  ASSERT_EQ(network.weights.size(), 3U);
  EXPECT_EQ(network.inputs(), 6);
  EXPECT_EQ(network.outputs(), 3);
  EXPECT_EQ(network.parameters(), 6 * 50 + 50 + 50 * 50 + 50 + 50 * 3 + 3);
  for (std::size_t i = 0; i < 3; ++i) {
    const double limit = std::sqrt(6.0 / static_cast<double>(network.weights[i].rows() + network.weights[i].cols()));
    EXPECT_LE(network.weights[i].cwiseAbs().maxCoeff(), limit);
    EXPECT_GT(network.weights[i].cwiseAbs().maxCoeff(), 0.9 * limit);
    EXPECT_TRUE(network.biases[i].isZero(0.0));
  }
  RandomStream same(1, 0, Purpose::kTest);
  RandomStream other(1, 1, Purpose::kTest);
  const NetworkShape shape{.inputs = 6, .hidden_layers = 2, .units = 50, .outputs = 3};
  EXPECT_EQ(parameters_of(random_network(shape, same)), parameters_of(network));
  EXPECT_NE(parameters_of(random_network(shape, other)), parameters_of(network));
}

TEST(FeedForwardNetwork, FaultsAreNamed) {
  RandomStream random(1, 0, Purpose::kTest);
  EXPECT_THAT(message_of([&] { random_network({.inputs = 0}, random); }), HasSubstr("inputs is 0"));
  EXPECT_THAT(message_of([&] { random_network({.hidden_layers = 101}, random); }), HasSubstr("hidden_layers is 101"));
  EXPECT_THAT(message_of([&] { random_network({.units = 0}, random); }), HasSubstr("units is 0"));
  EXPECT_THAT(message_of([&] { random_network({.outputs = -1}, random); }), HasSubstr("outputs is -1"));
  const auto fault = [](auto spoil) {
    FeedForwardNetwork network = network_of({.inputs = 3, .hidden_layers = 2, .units = 4});
    spoil(network);
    return fault_of(network);
  };
  EXPECT_EQ(fault([](auto&) {}), "");
  EXPECT_THAT(fault([](auto& n) { n = {}; }), HasSubstr("no layer"));
  EXPECT_THAT(fault([](auto& n) { n.biases.pop_back(); }), HasSubstr("weights of 3 layers and biases of 2"));
  EXPECT_THAT(fault([](auto& n) { n.weights[1].resize(0, 0); }), HasSubstr("layer 1 has no weights"));
  EXPECT_THAT(fault([](auto& n) { n.biases[1].setZero(3); }), HasSubstr("layer 1 has 4 units and 3 biases"));
  EXPECT_THAT(fault([](auto& n) { n.weights[1].setZero(4, 5); }), HasSubstr("5 inputs, the one before has 4"));
  EXPECT_THAT(fault([](auto& n) { n.biases[0][2] = std::nan(""); }), HasSubstr("layer 0 isn't finite"));
}

TEST(RangeScaling, MapsRangesAndKeepsWhatNeverChanged) {
  const RangeScaling scaling = range_scaling((Eigen::MatrixXd(3, 2) << 2, 7, 6, 7, 4, 7).finished());
  EXPECT_DOUBLE_EQ(scaling.scaled(0, 2.0), -1.0);
  EXPECT_DOUBLE_EQ(scaling.scaled(0, 6.0), 1.0);
  EXPECT_DOUBLE_EQ(scaling.scaled(0, 8.0), 2.0);
  EXPECT_DOUBLE_EQ(scaling.unscaled(0, 0.5), 5.0);
  EXPECT_DOUBLE_EQ(scaling.scaled(1, 9.0), 0.0);
  EXPECT_DOUBLE_EQ(scaling.unscaled(1, 0.7), 7.0);
  EXPECT_TRUE(is_sound(scaling));
  EXPECT_FALSE(is_sound({Eigen::Vector2d(0, 1), Eigen::VectorXd::Ones(1)}));
  EXPECT_FALSE(is_sound({Eigen::Vector2d(0, 2), Eigen::Vector2d(1, 1)}));
  EXPECT_FALSE(is_sound({Eigen::Vector2d(0, std::nan("")), Eigen::Vector2d(1, 1)}));
  EXPECT_FALSE(is_sound({Eigen::VectorXd::Constant(1, -1e308), Eigen::VectorXd::Constant(1, 1.7e308)}));
}

TEST(EarlyStopping, KeepsTheBestAndStopsAfterSoManyWithoutABetterOne) {
  EarlyStopping stopping(3);
  const double losses[] = {5.0, 4.0, 4.5, 3.0, 3.0, 3.1, 2.9, 3.0, 3.0, 3.0};
  int step = 0;
  for (; step < 10; ++step) {
    if (stopping.shows(step, losses[step], Eigen::VectorXd::Constant(1, step))) break;
  }
  EXPECT_EQ(step, 9);
  EXPECT_EQ(stopping.best_step(), 6);
  EXPECT_EQ(stopping.best()[0], 6.0);
}

}  // namespace
}  // namespace touchstone::sensors
