#pragma once
// Least squares within bounds, for functions that cost much to evaluate.
//
// Levenberg's step [Levenberg1944] (J^T J + lambda I) p = -J^T r, with the damping raised and lowered by how much of
// the promised decrease came true [Madsen2004, algorithm 3.16]. Variables must be scaled so that their ranges are
// alike, since the damping treats them alike. A variable that stands at a bound and is pulled beyond stays there for
// the step (projected Newton [Bertsekas1982]).

#include <Eigen/Core>
#include <functional>

namespace touchstone::lab {

/// Residuals as a function of some variables, and the box that these may be in.
struct LeastSquaresProblem {
  std::function<Eigen::VectorXd(const Eigen::VectorXd& x)> residuals;
  /// Rows as the residuals, columns as x. `at` is what residuals(x) gave.
  std::function<Eigen::MatrixXd(const Eigen::VectorXd& x, const Eigen::VectorXd& at)> jacobian;
  Eigen::VectorXd low, high;  ///< of x
  /// Called after each step: where it led, the residuals there, and the step's number from 1. May be empty.
  std::function<void(const Eigen::VectorXd& x, const Eigen::VectorXd& at, int step)> on_step;
};

/// Damping, and when the search ends.
struct LeastSquaresSettings {
  double first_damping = 1e-4;  ///< times the largest diagonal entry of J^T J
  /// Ends where a whole step would lower the sum of squares by less than this part of the mean square of a residual: at
  /// 0.01 the step is a tenth of a standard error.
  double least_gain = 0.01;
  int most_steps = 30;  ///< Jacobians
};

/// The best place found.
struct LeastSquaresResult {
  Eigen::VectorXd x;
  Eigen::VectorXd residuals;
  Eigen::MatrixXd jacobian;  ///< at x
  int steps = 0;             ///< taken
  bool converged = false;
};

/// @pre low <= start <= high, all finite
LeastSquaresResult least_squares(const LeastSquaresProblem& problem, const Eigen::VectorXd& start,
                                 const LeastSquaresSettings& settings = {});

}  // namespace touchstone::lab
