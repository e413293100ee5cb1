#include "sensors/learning/scaled_conjugate_gradient.h"
#include "tests/support/message_of.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace touchstone::sensors {
namespace {

using test::message_of;
using testing::HasSubstr;

TEST(ScaledConjugateGradient, AQuadraticBowlOfNDimensionsTakesNSteps) {
  // Conjugate directions: exact but for Moller's lambda (5e-7 of the identity), which leaves a part of 1e-6 a step.
  const Eigen::VectorXd curvatures = (Eigen::VectorXd(6) << 1.0, 2.0, 3.5, 5.0, 8.0, 10.0).finished();
  const Eigen::VectorXd centre = (Eigen::VectorXd(6) << 1.0, -2.0, 0.5, 3.0, -1.0, 0.2).finished();
  const ValueAndGradient bowl = [&](const Eigen::VectorXd& x, Eigen::VectorXd& gradient) {
    gradient = curvatures.cwiseProduct(x - centre);
    return 0.5 * (x - centre).dot(gradient);
  };
  Eigen::VectorXd x = Eigen::VectorXd::Zero(6);
  ScaledConjugateGradientSettings settings;
  settings.most_steps = 6;
  std::vector<double> values;
  minimise_by_scaled_conjugate_gradient(bowl, x, settings, [&](int, const Eigen::VectorXd&, double value) {
    values.push_back(value);
    return false;
  });
  EXPECT_LT((x - centre).norm(), 1e-5);
  ASSERT_EQ(values.size(), 6U);
  EXPECT_GT(values[4], 1e-4);  // and not fewer
  for (std::size_t i = 1; i < 6; ++i) EXPECT_LT(values[i], values[i - 1]);
}

TEST(ScaledConjugateGradient, FindsTheEndOfRosenbrocksValley) {
  const ValueAndGradient valley = [](const Eigen::VectorXd& x, Eigen::VectorXd& gradient) {
    const double a = x[1] - x[0] * x[0];
    const double b = 1.0 - x[0];
    gradient = Eigen::Vector2d(-400.0 * x[0] * a - 2.0 * b, 200.0 * a);
    return 100.0 * a * a + b * b;
  };
  Eigen::VectorXd x = Eigen::Vector2d(-1.2, 1.0);
  const auto end = minimise_by_scaled_conjugate_gradient(valley, x, {.most_steps = 2000});
  EXPECT_TRUE(end.is_flat);
  EXPECT_LT((x - Eigen::Vector2d(1.0, 1.0)).norm(), 1e-7);
  EXPECT_LE(end.gradients, 2 * end.steps + 1);
}

TEST(ScaledConjugateGradient, EndsWhenItIsAskedTo) {
  const ValueAndGradient bowl = [](const Eigen::VectorXd& x, Eigen::VectorXd& gradient) {
    gradient = Eigen::Vector2d(x[0], 50.0 * x[1]);
    return 0.5 * x.dot(gradient);
  };
  Eigen::VectorXd x = Eigen::Vector2d(1.0, 1.0);
  Eigen::VectorXd watched;
  const auto end = minimise_by_scaled_conjugate_gradient(bowl, x, {}, [&](int, const Eigen::VectorXd& at, double) {
    watched = at;
    return true;
  });
  EXPECT_TRUE(end.was_stopped);
  EXPECT_EQ(x, watched);
  x = Eigen::Vector2d::Zero();
  EXPECT_TRUE(minimise_by_scaled_conjugate_gradient(bowl, x).is_flat);
}

TEST(ScaledConjugateGradient, StaysWhereTheFunctionIsFinite) {
  // x - log x has its minimum at 1 and isn't finite from 0 down: the first steps from far right leap over it.
  const ValueAndGradient barrier = [](const Eigen::VectorXd& x, Eigen::VectorXd& gradient) {
    gradient = (1.0 - x.array().inverse()).matrix();
    return x[0] > 0.0 ? x[0] - std::log(x[0]) : std::nan("");
  };
  Eigen::VectorXd x = Eigen::VectorXd::Constant(1, 30.0);
  const auto end = minimise_by_scaled_conjugate_gradient(barrier, x);
  EXPECT_TRUE(end.is_flat);
  EXPECT_NEAR(x[0], 1.0, 1e-8);
}

TEST(ScaledConjugateGradient, FaultyInputIsNamed) {
  const ValueAndGradient line = [](const Eigen::VectorXd& x, Eigen::VectorXd& gradient) {
    gradient = Eigen::VectorXd::Ones(x.size());
    return x[0];
  };
  const auto message = [&](auto spoil) {
    ScaledConjugateGradientSettings settings;
    spoil(settings);
    Eigen::VectorXd x = Eigen::VectorXd::Ones(1);
    return message_of([&] { minimise_by_scaled_conjugate_gradient(line, x, settings); });
  };
  EXPECT_THAT(message([](auto& s) { s.first_sigma = 0.0; }), HasSubstr("first_sigma is 0"));
  EXPECT_THAT(message([](auto& s) { s.first_lambda = 2.0; }), HasSubstr("first_lambda is 2"));
  EXPECT_THAT(message([](auto& s) { s.least_gradient = std::nan(""); }), HasSubstr("least_gradient is nan"));
  EXPECT_THAT(message([](auto& s) { s.most_steps = 0; }), HasSubstr("most_steps is 0"));
  Eigen::VectorXd x = Eigen::VectorXd::Constant(1, std::nan(""));
  EXPECT_THAT(message_of([&] { minimise_by_scaled_conjugate_gradient(line, x); }), HasSubstr("isn't finite"));
}

}  // namespace
}  // namespace touchstone::sensors
