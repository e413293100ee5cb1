#include "lab/fit/bounded_least_squares.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/dense_solvers.h"
#include "core/error.h"

namespace touchstone::lab {
namespace {

constexpr double kMostDamping = 1e12;     // times the largest diagonal entry: no step is left
constexpr double kLeastOfPromise = 0.25;  // LeastSquaresSettings::rough_within

/// Which variables aren't held at a bound that the gradient pulls them beyond.
std::vector<Eigen::Index> free_variables(const LeastSquaresProblem& problem, const Eigen::VectorXd& x,
                                         const Eigen::VectorXd& gradient) {
  std::vector<Eigen::Index> free;
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    const bool held = (x[i] <= problem.low[i] && gradient[i] > 0.0) || (x[i] >= problem.high[i] && gradient[i] < 0.0);
    if (!held) free.push_back(i);
  }
  return free;
}

/// The damped step, cut at the bounds.
Eigen::VectorXd step_within(const LeastSquaresProblem& problem, const Eigen::VectorXd& x,
                            const Eigen::MatrixXd& hessian, const Eigen::VectorXd& gradient, double damping) {
  const std::vector<Eigen::Index> free = free_variables(problem, x, gradient);
  const auto count = static_cast<Eigen::Index>(free.size());
  Eigen::VectorXd step = Eigen::VectorXd::Zero(x.size());
  if (count == 0) return step;
  Eigen::MatrixXd matrix(count, count);
  Eigen::VectorXd right(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    right[i] = -gradient[free[i]];
    for (Eigen::Index j = 0; j < count; ++j) matrix(i, j) = hessian(free[i], free[j]);
    matrix(i, i) += damping;
  }
  const Eigen::VectorXd part = matrix.ldlt().solve(right);
  for (Eigen::Index i = 0; i < count; ++i) step[free[i]] = part[i];
  return (x + step).cwiseMax(problem.low).cwiseMin(problem.high) - x;
}

/// By how much the linear model's sum of squares falls.
double promised(const Eigen::MatrixXd& hessian, const Eigen::VectorXd& gradient, const Eigen::VectorXd& step) {
  return -2.0 * gradient.dot(step) - step.dot(hessian * step);
}

}  // namespace

LeastSquaresResult least_squares(const LeastSquaresProblem& problem, LeastSquaresState at,
                                 const LeastSquaresSettings& settings) {
  TS_ASSERT(at.x.allFinite() && (at.x.array() >= problem.low.array()).all() &&
            (at.x.array() <= problem.high.array()).all());
  const auto keep = [&] {
    if (problem.on_state) problem.on_state(at);
  };
  const auto settled = [&](const Eigen::VectorXd& x) { return problem.settled ? problem.settled(x) : x; };
  if (at.residuals.size() == 0) {
    at.x = settled(at.x);
    at.residuals = problem.residuals(at.x);
    TS_ASSERT(at.residuals.allFinite());
    keep();
  }
  const auto result = [&](bool converged) {
    return LeastSquaresResult{at.x, at.residuals, at.jacobian, at.steps, converged};
  };
  for (;;) {
    const double squares = at.residuals.squaredNorm();
    const double mean_square =
        std::max(settings.least_square, squares / static_cast<double>(std::max<Eigen::Index>(1, at.residuals.size())));
    if (at.jacobian.size() == 0) {
      at.jacobian = problem.jacobian(at.x, at.residuals);
      keep();
    }
    const Eigen::MatrixXd hessian = at.jacobian.transpose() * at.jacobian;
    const Eigen::VectorXd gradient = at.jacobian.transpose() * at.residuals;
    const double largest = std::max(hessian.diagonal().maxCoeff(), 1e-300);
    if (at.damping < 0.0) at.damping = settings.first_damping * largest;
    const double enough = settings.least_gain * mean_square;
    // With much damping any step is small: a nearly free one tells what is left to gain.
    const Eigen::VectorXd whole =
        step_within(problem, at.x, hessian, gradient, std::min(at.damping, settings.first_damping * largest));
    if (at.arrived || promised(hessian, gradient, whole) <= enough) return result(true);
    if (at.steps >= settings.most_steps) return result(false);
    const bool near = whole.cwiseAbs().maxCoeff() <= settings.rough_within;
    Eigen::VectorXd step = step_within(problem, at.x, hessian, gradient, at.damping);
    for (;;) {
      const double promise = promised(hessian, gradient, step);
      const bool refused = at.growth > 2.0;  // since the last step
      // What the model promises doesn't come true.
      if (refused && (near || promise <= enough)) return result(near);
      if (at.damping > kMostDamping * largest) return result(false);
      const Eigen::VectorXd x = settled(at.x + step);
      const Eigen::VectorXd residuals = problem.residuals(x);
      const double gain = squares - residuals.squaredNorm();
      if (gain > 0.0) {  // false of NaN, too
        at.damping *= std::max(1.0 / 3.0, 1.0 - std::pow(2.0 * gain / promise - 1.0, 3));
        at.growth = 2.0;
        at.x = x;
        at.residuals = residuals;
        at.jacobian.resize(0, 0);
        at.arrived = near && gain < kLeastOfPromise * promise;
        ++at.steps;
        keep();
        break;
      }
      // Little damping changes nothing, and each trial is expensive: on to a step of half the length.
      const double half = 0.5 * step.norm();
      do {
        at.damping *= at.growth;
        at.growth *= 2.0;
        step = step_within(problem, at.x, hessian, gradient, at.damping);
      } while (step.norm() > half && at.damping <= kMostDamping * largest);
      keep();
    }
  }
}

}  // namespace touchstone::lab
