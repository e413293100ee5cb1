#include "sensors/learning/confusion_matrix.h"

#include <numeric>
#include <vector>

#include "core/error.h"

namespace touchstone::sensors {

double ConfusionMatrix::accuracy() const {
  std::vector<int> all(static_cast<std::size_t>(counts.rows()));
  std::iota(all.begin(), all.end(), 0);
  return accuracy(all);
}

double ConfusionMatrix::accuracy(std::span<const int> classes) const {
  double right = 0.0;
  double total = 0.0;
  for (const int one : classes) {
    TS_ASSERT(one >= 0 && one < counts.rows());
    right += counts(one, one);
    total += counts.row(one).sum();
  }
  return right / total;
}

ConfusionMatrix confusion_matrix(std::span<const int> truth, std::span<const int> guesses, int classes) {
  if (classes < 1) fail("confusion matrix: {} classes; at least 1 is needed", classes);
  if (truth.size() != guesses.size()) {
    fail("confusion matrix: {} samples and {} guesses; they must be as many", truth.size(), guesses.size());
  }
  ConfusionMatrix matrix{Eigen::MatrixXi::Zero(classes, classes)};
  for (std::size_t i = 0; i < truth.size(); ++i) {
    for (const int label : {truth[i], guesses[i]}) {
      if (label < 0 || label >= classes) fail("confusion matrix: sample {}: class {}, there are {}", i, label, classes);
    }
    ++matrix.counts(truth[i], guesses[i]);
  }
  return matrix;
}

}  // namespace touchstone::sensors
