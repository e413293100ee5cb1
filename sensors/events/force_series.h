#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

namespace touchstone::sensors {

/// One grasp to train or to test force estimators on: what they see, and the force that a reference measured.
struct ForceSeries {
  Eigen::MatrixXd
      features;  ///< a window a row: accumulated ON and OFF counts (sensors/events/grasp_sequence.h), maybe time
  Eigen::VectorXd force_N;  ///< of each window
  std::vector<int> judged;  ///< the rows that are trained and tested on
};

/// What is wrong with a series (sizes, rows that aren't there, values that aren't finite), or nothing.
std::string fault_of(const ForceSeries& series);

/// The judged rows of several series, one below the other.
struct StackedSeries {
  Eigen::MatrixXd features;
  Eigen::VectorXd force_N;
};

/// @param chosen indices in `series`
/// @throws Error naming the series: an index that isn't there, a faulty series, or another number of features than the
///   first chosen one has
StackedSeries stack(std::span<const ForceSeries> series, std::span<const int> chosen);

}  // namespace touchstone::sensors
