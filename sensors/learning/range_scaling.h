#pragma once

#include <Eigen/Core>

namespace touchstone::sensors {

/// Maps each of several quantities from the range that it had in training to [-1, 1]: what networks of sigmoids are fed
/// with, and are asked for. A quantity that never changed is mapped to 0, and back to the value that it had.
struct RangeScaling {
  Eigen::VectorXd low;
  Eigen::VectorXd high;

  Eigen::Index size() const { return low.size(); }
  /// Quantity i; beyond -1 or 1 where the value is outside of its range in training.
  double scaled(Eigen::Index i, double value) const {
    return high[i] > low[i] ? (value - low[i]) * (2.0 / (high[i] - low[i])) - 1.0 : 0.0;
  }
  /// Back.
  double unscaled(Eigen::Index i, double value) const {
    return high[i] > low[i] ? low[i] + (value + 1.0) * (0.5 * (high[i] - low[i])) : low[i];
  }
};

/// Of samples, a row each. @pre at least one sample, all values finite
inline RangeScaling range_scaling(const Eigen::MatrixXd& samples) {
  return {samples.colwise().minCoeff().transpose(), samples.colwise().maxCoeff().transpose()};
}

/// Whether its values are finite, as many low as high, and none crossed.
inline bool is_sound(const RangeScaling& scaling) {
  return scaling.low.size() == scaling.high.size() && scaling.low.allFinite() && scaling.high.allFinite() &&
         (scaling.high - scaling.low).allFinite() && (scaling.high.array() >= scaling.low.array()).all();
}

}  // namespace touchstone::sensors
