#include "sensors/reflex/statistics_force.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "sensors/reflex/contact_tree.h"

namespace touchstone::sensors {

std::array<double, kStatisticsTerms> statistics_terms(const ChipStatistics& statistics) {
  std::array<double, kStatisticsTerms> terms{1.0};
  std::size_t next = 1;
  for (const ChipFeature feature : kChipFeatures) terms[next++] = value_of(statistics, feature);
  for (std::size_t i = 1; i <= kChipFeatures.size(); ++i) {
    for (std::size_t k = i; k <= kChipFeatures.size(); ++k) terms[next++] = terms[i] * terms[k];
  }
  return terms;
}

double StatisticsForce::force_N(const ChipStatistics& statistics) const {
  const std::array<double, kStatisticsTerms> terms = statistics_terms(statistics);
  double sum = 0.0;
  for (std::size_t i = 0; i < kStatisticsTerms; ++i) sum += coefficients[i] * terms[i];
  return std::max(sum, 0.0);
}

StatisticsForce fit_statistics_force(std::span<const StatisticsForceSample> samples, int degree) {
  if (degree != 1 && degree != 2) fail("force of statistics: the degree is {}, it must be 1 or 2", degree);
  const std::size_t terms = degree == 1 ? 1 + kChipFeatures.size() : kStatisticsTerms;
  if (samples.size() < 2 * terms) {
    fail("force of statistics: {} samples with force, at least {} are needed", samples.size(), 2 * terms);
  }
  const auto count = static_cast<Eigen::Index>(samples.size());
  Eigen::MatrixXd matrix(count, static_cast<Eigen::Index>(terms));
  Eigen::VectorXd forces(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const StatisticsForceSample& one = samples[static_cast<std::size_t>(i)];
    if (!is_possible(one.statistics) || !std::isfinite(one.force_N)) {
      fail("force of statistics: sample {} has MAX {}, MIN {}, SQ {}, AVG {} and {} N; pixels are 0 to 63, SQ 0 to 255",
           i, one.statistics.maximum, one.statistics.minimum, one.statistics.squal, one.statistics.average,
           one.force_N);
    }
    const auto row = statistics_terms(one.statistics);
    for (std::size_t k = 0; k < terms; ++k) matrix(i, static_cast<Eigen::Index>(k)) = row[k];
    forces[i] = one.force_N;
  }
  const Eigen::VectorXd size = matrix.colwise().norm().cwiseMax(1e-12).transpose();
  const Eigen::MatrixXd scaled = matrix * size.cwiseInverse().asDiagonal();
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> factors;
  factors.setThreshold(1e-9);
  factors.compute(scaled);
  const Eigen::VectorXd solution = factors.solve(forces).cwiseQuotient(size);
  StatisticsForce model;
  model.degree = degree;
  for (std::size_t k = 0; k < terms; ++k) model.coefficients[k] = solution[static_cast<Eigen::Index>(k)];
  double squares = 0.0;
  for (const StatisticsForceSample& one : samples) squares += std::pow(model.force_N(one.statistics) - one.force_N, 2);
  model.rms_residual_N = std::sqrt(squares / static_cast<double>(count));
  return model;
}

}  // namespace touchstone::sensors
