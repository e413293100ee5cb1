#pragma once

#include <Eigen/Core>
#include <span>

namespace touchstone::sensors {

/// How often samples of class `row` were taken for class `column`: [Naeini2020, fig. 12].
struct ConfusionMatrix {
  Eigen::MatrixXi counts;

  /// Share of the right ones, 0 to 1; of all, or of the samples of some classes. NaN without samples.
  double accuracy() const;
  double accuracy(std::span<const int> classes) const;
};

/// @throws Error for other lengths, fewer than 1 class, or a label that isn't a class
ConfusionMatrix confusion_matrix(std::span<const int> truth, std::span<const int> guesses, int classes);

}  // namespace touchstone::sensors
