#include "sensors/events/force_score.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace touchstone::sensors {
namespace {

void check(const Eigen::VectorXd& estimate, const Eigen::VectorXd& reference) {
  if (estimate.size() == 0 || estimate.size() != reference.size()) {
    fail("force score: {} estimates and {} references; they must be as many, and at least 1", estimate.size(),
         reference.size());
  }
  if (!estimate.allFinite() || !reference.allFinite()) fail("force score: a force isn't finite");
}

}  // namespace

double mean_squared_error(const Eigen::VectorXd& estimate_N, const Eigen::VectorXd& reference_N) {
  check(estimate_N, reference_N);
  return (estimate_N - reference_N).squaredNorm() / static_cast<double>(estimate_N.size());
}

std::optional<double> least_force_change(const Eigen::VectorXd& estimate_N, const Eigen::VectorXd& level_N,
                                         double least_N) {
  check(estimate_N, level_N);
  std::optional<double> least;
  for (Eigen::Index i = 1; i < estimate_N.size(); ++i) {
    if (level_N[i - 1] < least_N || level_N[i] < least_N) continue;
    const double change = std::abs(estimate_N[i] - estimate_N[i - 1]);
    least = least ? std::min(*least, change) : change;
  }
  return least;
}

double sensitivity(std::span<const std::optional<double>> least_changes) {
  double sum = 0.0;
  int count = 0;
  for (const std::optional<double>& change : least_changes) {
    if (!change) continue;
    sum += *change;
    ++count;
  }
  if (count == 0)
    fail("force score: in none of {} folds two forces above the level follow each other", least_changes.size());
  return sum / count;
}

}  // namespace touchstone::sensors
