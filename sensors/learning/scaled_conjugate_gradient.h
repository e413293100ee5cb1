#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>

namespace touchstone::sensors {

/// Value of a function at x; fills its gradient.
using ValueAndGradient = std::function<double(const Eigen::VectorXd& x, Eigen::VectorXd& gradient)>;

/// Moller's constants, and when the search ends.
struct ScaledConjugateGradientSettings {
  double first_sigma = 5e-5;     ///< Moller's sigma: length of the step that gives the curvature; above 0, at most 1e-2
  double first_lambda = 5e-7;    ///< Moller's lambda_1; above 0, at most 1
  double least_gradient = 1e-9;  ///< largest entry: below, it ends
  int most_steps = 1000;         ///< at least 1
};

/// Why the search ended, and what it took.
struct ScaledConjugateGradientEnd {
  bool is_flat = false;      ///< the gradient has vanished
  bool was_stopped = false;  ///< by `watch`
  int steps = 0;             ///< tried, those that failed with them
  int gradients = 0;         ///< evaluations of the function
};

/// Minimises from x on, which takes the best place: scaled conjugate gradient [Moller1993, steps 1 to 9]. On a
/// quadratic bowl of n dimensions it ends in n steps. A place where the function isn't finite counts as a step that
/// fails.
/// @param watch is called after each step that didn't fail: its number, x and the value there; if it returns true, that
/// is the end
/// @throws Error if a setting is out of its range, x is empty, or value or gradient aren't finite at the first place
ScaledConjugateGradientEnd minimise_by_scaled_conjugate_gradient(
    const ValueAndGradient& function, Eigen::VectorXd& x, const ScaledConjugateGradientSettings& settings = {},
    const std::function<bool(int step, const Eigen::VectorXd& x, double value)>& watch = {});

}  // namespace touchstone::sensors
