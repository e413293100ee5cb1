#include "lab/fit/bounded_least_squares.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/dense_solvers.h"
#include "core/error.h"

namespace touchstone::lab {
namespace {

constexpr double kMostDamping = 1e12;  // times the largest diagonal entry: no step is left

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

LeastSquaresResult least_squares(const LeastSquaresProblem& problem, const Eigen::VectorXd& start,
                                 const LeastSquaresSettings& settings) {
  TS_ASSERT(start.allFinite() && (start.array() >= problem.low.array()).all() &&
            (start.array() <= problem.high.array()).all());
  LeastSquaresResult result;
  result.x = start;
  result.residuals = problem.residuals(start);
  TS_ASSERT(result.residuals.allFinite());
  double damping = -1.0;
  double growth = 2.0;
  while (result.steps < settings.most_steps) {
    result.jacobian = problem.jacobian(result.x, result.residuals);
    const Eigen::MatrixXd hessian = result.jacobian.transpose() * result.jacobian;
    const Eigen::VectorXd gradient = result.jacobian.transpose() * result.residuals;
    const double largest = std::max(hessian.diagonal().maxCoeff(), 1e-300);
    if (damping < 0.0) damping = settings.first_damping * largest;
    const double squares = result.residuals.squaredNorm();
    const double enough =
        settings.least_gain * squares / static_cast<double>(std::max<Eigen::Index>(1, result.residuals.size()));
    // With much damping any step is small: a nearly free one tells what is left to gain.
    const Eigen::VectorXd whole =
        step_within(problem, result.x, hessian, gradient, std::min(damping, settings.first_damping * largest));
    result.converged = promised(hessian, gradient, whole) <= enough;
    if (result.converged) return result;
    for (;;) {
      const Eigen::VectorXd step = step_within(problem, result.x, hessian, gradient, damping);
      const Eigen::VectorXd x = result.x + step;
      const Eigen::VectorXd residuals = problem.residuals(x);
      const double gain = squares - residuals.squaredNorm();
      if (gain > 0.0) {  // false of NaN, too
        const double ratio = gain / promised(hessian, gradient, step);
        damping *= std::max(1.0 / 3.0, 1.0 - std::pow(2.0 * ratio - 1.0, 3));
        growth = 2.0;
        result.x = x;
        result.residuals = residuals;
        ++result.steps;
        if (problem.on_step) problem.on_step(result.x, result.residuals, result.steps);
        break;
      }
      damping *= growth;
      growth *= 2.0;
      if (damping > kMostDamping * largest) return result;  // stuck: what the model promises doesn't come true
    }
  }
  result.jacobian = problem.jacobian(result.x, result.residuals);
  return result;
}

}  // namespace touchstone::lab
