#include "sensors/learning/levenberg_marquardt.h"
#include "tests/support/message_of.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <cmath>

namespace touchstone::sensors {
namespace {

using test::message_of;
using testing::HasSubstr;

FeedForwardNetwork network_of(const NetworkShape& shape, std::uint64_t seed = 1) {
  RandomStream random(seed, 0, Purpose::kTest);
  return random_network(shape, random);
}

NetworkSamples sine(Eigen::Index count, double offset) {
  NetworkSamples samples{Eigen::MatrixXd(1, count), Eigen::MatrixXd(1, count)};
  for (Eigen::Index i = 0; i < count; ++i) {
    samples.inputs(0, i) = -1.0 + 2.0 * (static_cast<double>(i) + offset) / static_cast<double>(count);
    samples.targets(0, i) = std::sin(3.0 * samples.inputs(0, i));
  }
  return samples;
}

const NetworkSamples kNone{Eigen::MatrixXd(1, 0), Eigen::MatrixXd(1, 0)};

TEST(LevenbergMarquardt, TheJacobianIsThatOfDifferences) {
  FeedForwardNetwork network = network_of({.inputs = 2, .hidden_layers = 3, .units = 5});
  const Eigen::MatrixXd inputs = Eigen::MatrixXd::Random(2, 7);
  const Eigen::MatrixXd derivatives = jacobian(network, inputs);
  const Eigen::VectorXd at = parameters_of(network);
  for (Eigen::Index i = 0; i < at.size(); ++i) {
    constexpr double kStep = 1e-5;
    const auto outputs = [&](double step) {
      Eigen::VectorXd moved = at;
      moved[i] += step;
      set_parameters(network, moved);
      return evaluate(network, inputs);
    };
    const Eigen::RowVectorXd difference = (outputs(kStep) - outputs(-kStep)) / (2.0 * kStep);
    EXPECT_LT((derivatives.col(i).transpose() - difference).cwiseAbs().maxCoeff(), 1e-9) << i;
  }
}

TEST(LevenbergMarquardt, BothFormsGiveTheStepOfEquation3) {
  for (const NetworkShape& shape :
       {NetworkShape{.inputs = 3, .hidden_layers = 2, .units = 6}, NetworkShape{.inputs = 3, .hidden_layers = 0},
        NetworkShape{.inputs = 3, .hidden_layers = 1, .units = 90}}) {
    const FeedForwardNetwork network = network_of(shape);
    const NetworkSamples samples{Eigen::MatrixXd::Random(3, 210), Eigen::MatrixXd::Random(1, 210)};
    const Eigen::MatrixXd derivatives = jacobian(network, samples.inputs);
    const Eigen::VectorXd errors = (evaluate(network, samples.inputs) - samples.targets).transpose();
    for (const double damping : {1e-3, 1.0, 100.0}) {
      Eigen::MatrixXd normal = derivatives.transpose() * derivatives;
      normal.diagonal().array() += damping;
      const Eigen::VectorXd expected = -normal.ldlt().solve(derivatives.transpose() * errors);
      for (const StepForm form : {StepForm::kNormal, StepForm::kDual}) {
        const LevenbergMarquardtSystem system(network, samples, form);
        EXPECT_NEAR(system.sum_of_squares(), errors.squaredNorm(), 1e-10);
        EXPECT_LT((system.half_gradient() - derivatives.transpose() * errors).norm(), 1e-10);
        EXPECT_LT((*system.step(damping) - expected).norm(), 1e-8 * expected.norm()) << damping;
      }
    }
  }
}

TEST(LevenbergMarquardt, TheCheaperFormIsTaken) {
  // k = 4, n = 40 on two counts in three windows: 5241 parameters. k = 1, n = 5: 41.
  const NetworkSamples samples{Eigen::MatrixXd::Random(6, 300), Eigen::MatrixXd::Random(1, 300)};
  const FeedForwardNetwork large = network_of({.inputs = 6, .hidden_layers = 4, .units = 40});
  EXPECT_EQ(large.parameters(), 5241);
  EXPECT_EQ(LevenbergMarquardtSystem(large, samples).form(), StepForm::kDual);
  const FeedForwardNetwork small = network_of({.inputs = 6, .hidden_layers = 1, .units = 5});
  EXPECT_EQ(small.parameters(), 41);
  EXPECT_EQ(LevenbergMarquardtSystem(small, samples).form(), StepForm::kNormal);
}

TEST(LevenbergMarquardt, ALinearProblemIsSolvedInOneStep) {
  // Without hidden layers the squared error is a quadratic bowl: one step without damping is the least squares.
  FeedForwardNetwork network = network_of({.inputs = 3, .hidden_layers = 0});
  const NetworkSamples samples{Eigen::MatrixXd::Random(3, 50), Eigen::MatrixXd::Random(1, 50)};
  Eigen::MatrixXd design(50, 4);
  design << samples.inputs.transpose(), Eigen::VectorXd::Ones(50);
  const Eigen::VectorXd expected = design.colPivHouseholderQr().solve(samples.targets.transpose());
  LevenbergMarquardtSettings settings;
  settings.first_damping = settings.least_damping = 1e-12;
  settings.most_steps = 1;
  train_by_levenberg_marquardt(network, samples, {Eigen::MatrixXd(3, 0), Eigen::MatrixXd(1, 0)}, settings);
  EXPECT_LT((parameters_of(network) - expected).norm(), 1e-10);
}

TEST(LevenbergMarquardt, EveryStepLowersTheError) {
  for (const StepForm form : {StepForm::kNormal, StepForm::kDual}) {
    FeedForwardNetwork network = network_of({.inputs = 1, .hidden_layers = 2, .units = 8});
    LevenbergMarquardtSettings settings;
    settings.most_steps = 40;
    settings.form = form;
    const NetworkTrainingReport report = train_by_levenberg_marquardt(network, sine(60, 0.0), kNone, settings);
    ASSERT_EQ(static_cast<int>(report.history.size()), report.steps + 1);
    for (std::size_t i = 1; i < report.history.size(); ++i) {
      EXPECT_LT(report.history[i].training_loss, report.history[i - 1].training_loss);
    }
    EXPECT_GE(report.factorisations, report.steps);
    const Eigen::MatrixXd errors = evaluate(network, sine(60, 0.0).inputs) - sine(60, 0.0).targets;
    EXPECT_NEAR(errors.squaredNorm() / 60.0, report.history.back().training_loss, 1e-12);
  }
}

TEST(LevenbergMarquardt, LearnsASineAndExclusiveOr) {
  FeedForwardNetwork network = network_of({.inputs = 1, .hidden_layers = 1, .units = 6});
  LevenbergMarquardtSettings settings;
  settings.most_steps = 200;
  train_by_levenberg_marquardt(network, sine(40, 0.0), sine(40, 0.5), settings);
  const NetworkSamples others = sine(40, 0.3);
  // Six units approximate one period: within 1e-3 also between the samples.
  EXPECT_LT((evaluate(network, others.inputs) - others.targets).cwiseAbs().maxCoeff(), 1e-3);

  NetworkSamples exclusive{Eigen::MatrixXd(2, 4), Eigen::MatrixXd(1, 4)};
  exclusive.inputs << 0, 0, 1, 1, 0, 1, 0, 1;
  exclusive.targets << 0, 1, 1, 0;
  FeedForwardNetwork gate = network_of({.inputs = 2, .hidden_layers = 1, .units = 4, .sigmoid = Sigmoid::kLogistic});
  const NetworkTrainingReport report =
      train_by_levenberg_marquardt(gate, exclusive, {Eigen::MatrixXd(2, 0), Eigen::MatrixXd(1, 0)}, settings);
  EXPECT_EQ(report.end, NetworkTrainingEnd::kFlat);
  EXPECT_LT((evaluate(gate, exclusive.inputs) - exclusive.targets).cwiseAbs().maxCoeff(), 1e-5);
}

TEST(LevenbergMarquardt, StopsEarlyAndKeepsWhatWasBestOnValidation) {
  // 12 noisy samples, 97 parameters: it learns the noise, and what it says elsewhere gets worse.
  NetworkSamples noisy = sine(12, 0.0);
  RandomStream random(2, 0, Purpose::kTest);
  for (double& target : noisy.targets.reshaped()) target += 0.4 * random.normal();
  const NetworkSamples validation = sine(40, 0.5);
  FeedForwardNetwork network = network_of({.inputs = 1, .hidden_layers = 2, .units = 8});
  const NetworkTrainingReport report = train_by_levenberg_marquardt(network, noisy, validation);
  EXPECT_EQ(report.end, NetworkTrainingEnd::kValidation);
  EXPECT_EQ(report.best_step, report.steps - 6);
  double least = report.history.front().validation_loss;
  for (const NetworkTrainingStep& step : report.history) least = std::min(least, step.validation_loss);
  EXPECT_EQ(report.history[static_cast<std::size_t>(report.best_step)].validation_loss, least);
  EXPECT_NEAR((evaluate(network, validation.inputs) - validation.targets).squaredNorm() / 40.0, least, 1e-12);
  EXPECT_LT(least, report.history.back().validation_loss);
}

TEST(LevenbergMarquardt, EndsWhereThereIsNothingToLearn) {
  FeedForwardNetwork network = network_of({.inputs = 1, .hidden_layers = 1, .units = 3});
  NetworkSamples samples = sine(10, 0.0);
  samples.targets = evaluate(network, samples.inputs);
  EXPECT_EQ(train_by_levenberg_marquardt(network, samples, kNone).end, NetworkTrainingEnd::kFlat);
  // Two targets for one input: the mean is the best there is; with no least gradient it goes on until nothing helps.
  samples = {Eigen::MatrixXd::Zero(1, 2), Eigen::MatrixXd(1, 2)};
  samples.targets << 0.1, 0.7;
  LevenbergMarquardtSettings settings;
  settings.least_gradient = 0.0;
  const NetworkTrainingReport report = train_by_levenberg_marquardt(network, samples, kNone, settings);
  EXPECT_TRUE(report.end == NetworkTrainingEnd::kStuck || report.end == NetworkTrainingEnd::kFlat);
  EXPECT_NEAR(report.history.back().training_loss, 0.09, 1e-12);
  settings.most_steps = 1;
  FeedForwardNetwork fresh = network_of({.inputs = 1, .hidden_layers = 1, .units = 3});
  EXPECT_EQ(train_by_levenberg_marquardt(fresh, sine(10, 0.0), kNone, settings).end, NetworkTrainingEnd::kOutOfSteps);
  EXPECT_STREQ(name_of(NetworkTrainingEnd::kValidation), "validation");
  EXPECT_STREQ(name_of(NetworkTrainingEnd::kFlat), "flat");
  EXPECT_STREQ(name_of(NetworkTrainingEnd::kStuck), "stuck");
  EXPECT_STREQ(name_of(NetworkTrainingEnd::kOutOfSteps), "out of steps");
}

TEST(LevenbergMarquardt, FaultyInputIsNamed) {
  const auto message = [](auto spoil) {
    FeedForwardNetwork network = network_of({.inputs = 1, .hidden_layers = 1, .units = 3});
    NetworkSamples training = sine(10, 0.0);
    NetworkSamples validation = sine(10, 0.5);
    LevenbergMarquardtSettings settings;
    settings.most_steps = 2;
    spoil(network, training, validation, settings);
    return message_of([&] { train_by_levenberg_marquardt(network, training, validation, settings); });
  };
  EXPECT_EQ(message([](auto&, auto&, auto&, auto&) {}), "no error");
  EXPECT_THAT(message([](auto& n, auto&, auto&, auto&) { n.weights.clear(); }), HasSubstr("no layer"));
  EXPECT_THAT(message([](auto& n, auto&, auto&, auto&) { n = network_of({.outputs = 2}); }), HasSubstr("2 outputs"));
  EXPECT_THAT(message([](auto&, auto& t, auto&, auto&) { t = kNone; }), HasSubstr("no training sample"));
  EXPECT_THAT(message([](auto&, auto& t, auto&, auto&) { t.targets.resize(1, 9); }), HasSubstr("10 inputs and 9"));
  EXPECT_THAT(message([](auto&, auto&, auto& v, auto&) { v.inputs.setZero(2, 10); }),
              HasSubstr("validation samples of 2 inputs"));
  EXPECT_THAT(message([](auto&, auto& t, auto&, auto&) { t.inputs(0, 3) = std::nan(""); }), HasSubstr("training"));
  EXPECT_THAT(message([](auto&, auto&, auto& v, auto&) { v.targets(0, 3) = INFINITY; }), HasSubstr("validation"));
  EXPECT_THAT(message([](auto&, auto&, auto&, auto& s) { s.first_damping = 0.0; }), HasSubstr("first_damping is 0"));
  EXPECT_THAT(message([](auto&, auto&, auto&, auto& s) { s.least_damping = 0.0; }), HasSubstr("least_damping is 0"));
  EXPECT_THAT(message([](auto&, auto&, auto&, auto& s) { s.most_damping = 1e-3; }), HasSubstr("most_damping is 0.001"));
  EXPECT_THAT(message([](auto&, auto&, auto&, auto& s) { s.damping_up = 1.0; }), HasSubstr("damping_up is 1"));
  EXPECT_THAT(message([](auto&, auto&, auto&, auto& s) { s.damping_down = 1.0; }), HasSubstr("damping_down is 1"));
  EXPECT_THAT(message([](auto&, auto&, auto&, auto& s) { s.least_gradient = -1.0; }),
              HasSubstr("least_gradient is -1"));
  EXPECT_THAT(message([](auto&, auto&, auto&, auto& s) { s.most_steps = 0; }), HasSubstr("most_steps is 0"));
  EXPECT_THAT(message([](auto&, auto&, auto&, auto& s) { s.patience = 0; }), HasSubstr("patience is 0"));
}

}  // namespace
}  // namespace touchstone::sensors
