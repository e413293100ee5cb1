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

/// Where a search stands: all that it needs to go on to the same end, bit for bit.
struct LeastSquaresState {
  Eigen::VectorXd x;
  Eigen::VectorXd residuals;  ///< at x; empty: the search hasn't begun
  Eigen::MatrixXd jacobian;   ///< at x; empty: not evaluated there yet
  double damping = -1.0;      ///< below 0: not chosen yet
  double growth = 2.0;
  int steps = 0;         ///< taken
  bool arrived = false;  ///< the last step showed that residuals are too rough for another
};

/// Residuals as a function of some variables, and the box that these may be in.
struct LeastSquaresProblem {
  std::function<Eigen::VectorXd(const Eigen::VectorXd& x)> residuals;
  /// Rows as the residuals, columns as x. `at` is what residuals(x) gave.
  std::function<Eigen::MatrixXd(const Eigen::VectorXd& x, const Eigen::VectorXd& at)> jacobian;
  Eigen::VectorXd low, high;  ///< of x
  /// The same place with those variables that cost little moved to where they are best, the others held (variable
  /// projection [Golub2003]): the search then goes through such places only. May be empty.
  std::function<Eigen::VectorXd(const Eigen::VectorXd& x)> settled;
  /// Called after each evaluation that was worth keeping. May be empty.
  std::function<void(const LeastSquaresState& state)> on_state;
};

/// Damping, and when the search ends.
struct LeastSquaresSettings {
  double first_damping = 1e-4;  ///< times the largest diagonal entry of J^T J
  /// Ends where a whole step would lower the sum of squares by less than this part of the mean square of a residual: at
  /// 0.01 the step is a tenth of a standard error.
  double least_gain = 0.01;
  /// A mean square below this counts as this: 1 where residuals are in standard deviations of their noise, of which
  /// standard errors are made, too.
  double least_square = 0.0;
  /// Within this distance, in each variable, a Jacobian would hold if the residuals were smooth. Where a whole step is
  /// no longer and gains less than a quarter of what is promised, they are rougher than it, and the search ends: it has
  /// converged as far as it can. 0: they are smooth.
  double rough_within = 0.0;
  int most_steps = 30;
};

/// The best place found.
struct LeastSquaresResult {
  Eigen::VectorXd x;
  Eigen::VectorXd residuals;
  Eigen::MatrixXd jacobian;  ///< at x
  int steps = 0;             ///< taken
  /// Nothing is left to gain, or nothing that can be found (LeastSquaresSettings::rough_within).
  bool converged = false;
};

/// @pre low <= x <= high of what it starts from, all finite
LeastSquaresResult least_squares(const LeastSquaresProblem& problem, LeastSquaresState start,
                                 const LeastSquaresSettings& settings = {});

}  // namespace touchstone::lab
