#pragma once
// How hard does it press? Normal force as a polynomial in the statistics of a motion-sensing chip's frame [Knoop2013,
// sec. III.D]: of degree 1 in the paper, of degree 2 for better estimates at a few more multiplications.

#include <array>
#include <cstddef>
#include <span>

#include "core/motion_chip.h"

namespace touchstone::sensors {

/// 1, then MAX, MIN, SQ, AVG, then their ten products in the order of the rows of an upper triangle.
inline constexpr std::size_t kStatisticsTerms = 15;
/// The terms of one frame, in that order.
std::array<double, kStatisticsTerms> statistics_terms(const ChipStatistics& statistics);

/// The polynomial, fitted to one fingertip.
struct StatisticsForce {
  int degree = 1;                                       ///< 1 or 2; with 1 the products' coefficients are 0
  std::array<double, kStatisticsTerms> coefficients{};  ///< N per term
  double rms_residual_N = 0.0;                          ///< on what it was fitted to, negatives being 0

  /// N, never below 0: no plate pulls. No allocation.
  double force_N(const ChipStatistics& statistics) const;
};

/// One frame at a known force.
struct StatisticsForceSample {
  ChipStatistics statistics;
  double force_N = 0.0;
};

/// Least squares; give it points with force only, as the paper does: the tree keeps the others away. Of statistics that
/// never change, or only together, the smallest coefficients are taken.
/// @throws Error for a degree other than 1 and 2, statistics out of range, a force that isn't finite, or fewer samples
/// than twice the terms
StatisticsForce fit_statistics_force(std::span<const StatisticsForceSample> samples, int degree = 1);

}  // namespace touchstone::sensors
