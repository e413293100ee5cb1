#include "lab/fit/fit_certainty.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <vector>

#include "core/random.h"
#include "lab/fit/bounded_least_squares.h"
#include "lab/fit/unit_fit_words.h"

namespace touchstone::lab {
namespace {

using Vector = Eigen::VectorXd;
using Matrix = Eigen::MatrixXd;

LeastSquaresState begun_at(const Vector& x) {
  LeastSquaresState state;
  state.x = x;
  return state;
}

TEST(BoundedLeastSquares, FindsRosenbrocksMinimum) {
  LeastSquaresProblem problem;
  problem.residuals = [](const Vector& x) { return Vector(Eigen::Vector2d(10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0])); };
  problem.jacobian = [](const Vector& x, const Vector&) {
    Matrix J(2, 2);
    J << -20.0 * x[0], 10.0, -1.0, 0.0;
    return J;
  };
  problem.low = Vector::Constant(2, -5.0);
  problem.high = Vector::Constant(2, 5.0);
  LeastSquaresSettings settings;
  settings.most_steps = 200;
  const LeastSquaresResult found = least_squares(problem, begun_at(Eigen::Vector2d(-1.2, 1.0)), settings);
  EXPECT_TRUE(found.converged);
  EXPECT_NEAR((found.x - Vector::Ones(2)).norm(), 0.0, 1e-3);
}

TEST(BoundedLeastSquares, StopsAtABoundAndMinimisesTheRest) {
  // (x - 2)^2 + (x + y - 1)^2 with x <= 1: x = 1, y = 0.
  LeastSquaresProblem problem;
  problem.residuals = [](const Vector& x) { return Vector(Eigen::Vector2d(x[0] - 2.0, x[0] + x[1] - 1.0)); };
  problem.jacobian = [](const Vector&, const Vector&) {
    Matrix J(2, 2);
    J << 1.0, 0.0, 1.0, 1.0;
    return J;
  };
  problem.low = Vector::Constant(2, -1.0);
  problem.high = Vector::Constant(2, 1.0);
  LeastSquaresSettings settings;
  settings.least_gain = 1e-8;
  const LeastSquaresResult found = least_squares(problem, begun_at(Eigen::Vector2d(-1.0, -0.5)), settings);
  EXPECT_TRUE(found.converged);
  EXPECT_EQ(found.x[0], 1.0);
  EXPECT_NEAR(found.x[1], 0.0, 1e-3);
}

// Rosenbrock's valley with a third variable that is settled each time, and a step that is refused now and then.
TEST(BoundedLeastSquares, GoesOnFromEachStateToTheSameEnd) {
  LeastSquaresProblem problem;
  problem.residuals = [](const Vector& x) {
    return Vector(Eigen::Vector3d(10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0], x[2] - x[0]));
  };
  problem.jacobian = [&](const Vector& x, const Vector& at) {
    Matrix J(3, 3);
    for (int k = 0; k < 3; ++k) J.col(k) = (problem.residuals(x + 1e-3 * Vector::Unit(3, k)) - at) / 1e-3;
    return J;
  };
  problem.settled = [](const Vector& x) { return Vector(Eigen::Vector3d(x[0], x[1], x[0])); };
  problem.low = Vector::Constant(3, -5.0);
  problem.high = Vector::Constant(3, 5.0);
  std::vector<LeastSquaresState> states;
  problem.on_state = [&](const LeastSquaresState& state) { states.push_back(state); };
  LeastSquaresSettings settings;
  settings.most_steps = 200;
  const LeastSquaresResult whole = least_squares(problem, begun_at(Eigen::Vector3d(-1.2, 1.0, 3.0)), settings);
  ASSERT_TRUE(whole.converged);
  EXPECT_NEAR((whole.x - Vector::Ones(3)).norm(), 0.0, 1e-2);
  EXPECT_EQ(whole.x[2], whole.x[0]);
  ASSERT_GT(states.size(), static_cast<std::size_t>(2 * whole.steps)) << "some step was refused";
  problem.on_state = nullptr;
  for (const LeastSquaresState& state : states) {
    const LeastSquaresResult rest = least_squares(problem, state, settings);
    EXPECT_EQ(rest.x, whole.x);
    EXPECT_EQ(rest.residuals, whole.residuals);
    EXPECT_EQ(rest.jacobian, whole.jacobian);
    EXPECT_EQ(rest.steps, whole.steps);
    EXPECT_TRUE(rest.converged);
  }
}

// What is simulated is rough. Where a step that is no longer than differences are taken over gains nothing, the search
// has arrived; a Jacobian that is wrong all over leads nowhere.
TEST(BoundedLeastSquares, RoughResidualsConvergeAndWrongJacobiansDoNot) {
  static constexpr double kDifference = 2e-2;
  const auto found_with = [](double slope_error) {
    LeastSquaresProblem problem;
    problem.residuals = [](const Vector& x) {
      Vector out(50);
      for (int i = 0; i < 50; ++i) {
        out[i] = (i % 2 == 0 ? 1.0 : -1.0) + 40.0 * (x[0] - 0.3) + 0.3 * std::sin(1e4 * x[0] + 0.1 * i);
      }
      return out;
    };
    problem.jacobian = [&](const Vector& x, const Vector& at) {
      const Vector other = problem.residuals(x + Vector::Constant(1, kDifference));
      return Matrix(slope_error * (other - at) / kDifference);
    };
    problem.low = Vector::Constant(1, -1.0);
    problem.high = Vector::Constant(1, 1.0);
    LeastSquaresSettings settings;
    settings.rough_within = kDifference;
    return least_squares(problem, begun_at(Vector::Zero(1)), settings);
  };
  const LeastSquaresResult found = found_with(1.0);
  EXPECT_TRUE(found.converged);
  EXPECT_LE(found.steps, 4);
  EXPECT_NEAR(found.x[0], 0.3, 0.01);
  EXPECT_FALSE(found_with(-1.0).converged);
}

/// A linear problem of two variables over a picture of tiles, whose noise is white and, per tile, alike.
struct Linear {
  Matrix jacobian;
  std::vector<int> tile;
};

constexpr int kTiles = 48, kRowsATile = 30;

Linear linear_problem() {
  Linear out;
  out.jacobian.resize(kTiles * kRowsATile, 2);
  RandomStream random(3, 0, Purpose::kTest);
  for (int tile = 0; tile < kTiles; ++tile) {
    const double slope = random.normal();  // smooth over a tile, as light is
    for (int i = 0; i < kRowsATile; ++i) {
      const int row = tile * kRowsATile + i;
      out.jacobian.row(row) << 5.0, 5.0 * slope + 0.5 * random.normal();
      out.tile.push_back(tile);
    }
  }
  return out;
}

double coverage(double white, double alike) {
  const Linear problem = linear_problem();
  const Vector truth = Eigen::Vector2d(0.2, -0.1);
  int inside = 0;
  constexpr int kTrials = 400;
  for (int trial = 0; trial < kTrials; ++trial) {
    RandomStream random(100 + static_cast<std::uint64_t>(trial), 0, Purpose::kTest);
    Vector data = problem.jacobian * truth;
    for (int tile = 0; tile < kTiles; ++tile) {
      const double shift = alike * random.normal();
      for (int i = 0; i < kRowsATile; ++i) data[tile * kRowsATile + i] += shift + white * random.normal();
    }
    const Vector found =
        (problem.jacobian.transpose() * problem.jacobian).ldlt().solve(problem.jacobian.transpose() * data);
    LinearisedFit fit;
    fit.jacobian = problem.jacobian;
    fit.residuals = problem.jacobian * found - data;
    fit.tile = problem.tile;
    fit.tiles = kTiles;
    fit.shared = 2;
    const FitCertainty certainty = certainty_of(fit);
    EXPECT_EQ(certainty.unidentified.cols(), 0);
    for (int k = 0; k < 2; ++k) inside += std::abs(found[k] - truth[k]) <= 1.96 * certainty.deviation[k] ? 1 : 0;
  }
  return static_cast<double>(inside) / (2.0 * kTrials);
}

TEST(FitCertainty, IntervalsOfWhiteNoiseHoldTheTruthAsOftenAsTheySay) {
  EXPECT_NEAR(coverage(1.0, 0.0), 0.96, 0.02);  // the larger of two estimates: a little more than 95 %
}

TEST(FitCertainty, ErrorsThatAreAlikeInATileAreNotTakenForMany) {
  const double share = coverage(1.0, 2.0);  // by noise alone a third would be left
  EXPECT_GT(share, 0.92);
  EXPECT_LT(share, 0.985);
}

TEST(FitCertainty, AMisfitWidensIntervalsInProportion) {
  EXPECT_NEAR(coverage(5.0, 0.0), 0.96, 0.02);
}

FitUnknown unknown(const std::string& name, UnknownHow how = UnknownHow::times) {
  return {name, name, how, 0.5, 2.0, {}};
}

TEST(FitCertainty, AProductIsIdentifiedAndItsFactorsAreNot) {
  const Linear problem = linear_problem();
  LinearisedFit fit;
  fit.jacobian.resize(problem.jacobian.rows(), 3);
  fit.jacobian << problem.jacobian.col(0), 2.0 * problem.jacobian.col(0), problem.jacobian.col(1);
  fit.residuals = Vector::Zero(problem.jacobian.rows());
  fit.tile = problem.tile;
  fit.tiles = kTiles;
  fit.shared = 3;
  const FitCertainty certainty = certainty_of(fit);
  ASSERT_EQ(certainty.unidentified.cols(), 1);
  EXPECT_EQ(certainty.identified[0], 0);
  EXPECT_EQ(certainty.identified[1], 0);
  EXPECT_EQ(certainty.identified[2], 1);
  EXPECT_TRUE(std::isinf(certainty.deviation[0]));
  EXPECT_LT(certainty.deviation[2], 0.1);
  // In logarithms both act alike: the second's range is twice the first's.
  const auto words = unidentifiable_combinations({unknown("a"), unknown("b"), unknown("c")}, certainty.unidentified,
                                                 Eigen::Vector3d(1, 2, 1));
  ASSERT_EQ(words.size(), 1U);
  EXPECT_EQ(words[0].words, "`a` and `b` only as their product");
}

TEST(FitCertainty, WhatNothingDependsOnIsNamedAlone) {
  Matrix unidentified = Matrix::Zero(4, 2);  // the product of a and b, and d: in some rotation
  const double h = std::sqrt(0.5);
  unidentified.col(0) << 0.8 * h, -0.8 * h, 0.0, 0.6;
  unidentified.col(1) << -0.6 * h, 0.6 * h, 0.0, 0.8;
  const auto words = unidentifiable_combinations({unknown("a"), unknown("b"), unknown("c"), unknown("d")}, unidentified,
                                                 Vector::Ones(4));
  ASSERT_EQ(words.size(), 2U);
  EXPECT_EQ(words[0].words, "`d`: what was recorded hardly depends on it, or not at all");
  EXPECT_EQ(words[1].words, "`a` and `b` only as their product");
}

TEST(FitCertainty, CommonErrorsOfTheMeshAddTheirPart) {
  LinearisedFit fit;
  fit.jacobian = Matrix::Constant(6, 1, 10.0);
  fit.residuals = Vector::Zero(6);
  fit.tile.assign(6, -1);
  fit.mesh_error = Vector::Constant(6, 2.0);
  const FitCertainty certainty = certainty_of(fit);
  EXPECT_NEAR(certainty.by_noise[0], 0.1 / std::sqrt(6.0), 1e-12);
  EXPECT_NEAR(certainty.by_mesh[0], 0.2, 1e-12);
  EXPECT_NEAR(certainty.deviation[0], std::hypot(0.2, 0.1 / std::sqrt(6.0)), 1e-12);
}

}  // namespace
}  // namespace touchstone::lab
