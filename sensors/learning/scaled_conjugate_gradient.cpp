#include "sensors/learning/scaled_conjugate_gradient.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace touchstone::sensors {

ScaledConjugateGradientEnd minimise_by_scaled_conjugate_gradient(
    const ValueAndGradient& function, Eigen::VectorXd& x, const ScaledConjugateGradientSettings& settings,
    const std::function<bool(int step, const Eigen::VectorXd& x, double value)>& watch) {
  const auto need = [](bool holds, const char* name, double value, const char* allowed) {
    if (!holds) fail("scaled conjugate gradient: {} is {}, it must be {}", name, value, allowed);
  };
  need(settings.first_sigma > 0.0 && settings.first_sigma <= 1e-2, "first_sigma", settings.first_sigma,
       "above 0 and at most 0.01");
  need(settings.first_lambda > 0.0 && settings.first_lambda <= 1.0, "first_lambda", settings.first_lambda,
       "above 0 and at most 1");
  need(settings.least_gradient >= 0.0, "least_gradient", settings.least_gradient, "at least 0");
  need(settings.most_steps >= 1, "most_steps", settings.most_steps, "at least 1");
  if (x.size() == 0) fail("scaled conjugate gradient: there is nothing to vary; at least one number is needed");
  constexpr double kMostLambda = 1e50;

  ScaledConjugateGradientEnd end;
  Eigen::VectorXd gradient(x.size());
  double value = function(x, gradient);
  ++end.gradients;
  if (!std::isfinite(value) || !gradient.allFinite()) {
    fail("scaled conjugate gradient: the function or its gradient isn't finite where it begins");
  }
  Eigen::VectorXd residual = -gradient;  // r
  Eigen::VectorXd direction = residual;  // p
  Eigen::VectorXd ahead(x.size());
  Eigen::VectorXd ahead_gradient(x.size());
  double lambda = settings.first_lambda;
  double raised = 0.0;  // Moller's lambda with a bar
  double curvature = 0.0;
  bool success = true;
  int since_restart = 0;
  while (end.steps < settings.most_steps) {
    if (!(residual.cwiseAbs().maxCoeff() > settings.least_gradient)) {
      end.is_flat = true;
      break;
    }
    const double square = direction.squaredNorm();
    if (success) {
      const double sigma = settings.first_sigma / std::sqrt(square);
      ahead = x + sigma * direction;
      function(ahead, ahead_gradient);
      ++end.gradients;
      curvature = direction.dot(ahead_gradient - gradient) / sigma;
      if (!std::isfinite(curvature)) curvature = -lambda * square;  // as if it curved down: made cautious below
    }
    curvature += (lambda - raised) * square;
    if (curvature <= 0.0) {
      raised = 2.0 * (lambda - curvature / square);
      curvature = -curvature + lambda * square;
      lambda = raised;
    }
    const double slope = direction.dot(residual);
    const double length = slope / curvature;
    ahead = x + length * direction;
    const double ahead_value = function(ahead, ahead_gradient);
    ++end.gradients;
    ++end.steps;
    const bool finite = std::isfinite(ahead_value) && ahead_gradient.allFinite();
    const double comparison = finite ? 2.0 * curvature * (value - ahead_value) / (slope * slope) : -1.0;
    if (comparison >= 0.0) {
      x = ahead;
      value = ahead_value;
      gradient = ahead_gradient;
      const Eigen::VectorXd next = -gradient;
      raised = 0.0;
      success = true;
      if (++since_restart >= x.size()) {
        since_restart = 0;
        direction = next;
      } else {
        const double beta = (next.squaredNorm() - next.dot(residual)) / slope;
        direction = next + beta * direction;
        if (!(direction.dot(next) > 0.0)) direction = next;  // rounding has turned it uphill
      }
      residual = next;
      if (watch && watch(end.steps, x, value)) {
        end.was_stopped = true;
        break;
      }
      if (comparison >= 0.75) lambda = std::max(0.25 * lambda, 1e-30);
    } else {
      raised = lambda;
      success = false;
    }
    if (comparison < 0.25) lambda = std::min(kMostLambda, lambda + curvature * (1.0 - comparison) / square);
    if (lambda >= kMostLambda) break;
  }
  return end;
}

}  // namespace touchstone::sensors
