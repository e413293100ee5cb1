#pragma once
// The least value of a function that is expensive to evaluate, in few evaluations: Bayesian optimisation with a
// Gaussian process as surrogate and expected improvement [Jones1998].

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <vector>

namespace touchstone::sensors {

/// A box to search in; corners in the function's own units, low below high.
struct SearchBox {
  Eigen::VectorXd low;
  Eigen::VectorXd high;
};

/// How often the function is evaluated, and where at first.
struct BayesianMinimumSettings {
  int evaluations = 10;  ///< in all
  /// The first ones: the place that was given, then a Latin hypercube [McKay1979]. At least 2, at most `evaluations`.
  int first_evaluations = 4;
  int candidates = 2000;  ///< places at which the expected improvement is looked at, each time
  std::uint64_t seed = 1;
  std::uint64_t stream = 0;  ///< which of several searches it is
};

/// The best place, and all that were tried.
struct BayesianMinimum {
  Eigen::VectorXd place;                ///< of the least value
  double value = 0.0;                   ///< the least one
  std::vector<Eigen::VectorXd> places;  ///< all, in order
  std::vector<double> values;
};

/// A value that isn't finite counts as the worst of those that are. The same arguments give the same bits.
/// @param first the place to begin with, within the box
/// @throws Error for an empty or faulty box, a first place outside of it, a setting out of its range, or if no value is
/// finite
BayesianMinimum find_bayesian_minimum(const std::function<double(const Eigen::VectorXd&)>& function,
                                      const SearchBox& box, const Eigen::VectorXd& first,
                                      const BayesianMinimumSettings& settings = {});

}  // namespace touchstone::sensors
