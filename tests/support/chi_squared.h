#pragma once
// Pearson's chi-squared test of samplers against their own densities.
//
//   expect_samples(draw, density, {16, 24});     // draw: next point of the unit square; density: over the square
//
// A sampler's domain is mapped to the unit square and cut into bins. What each bin should hold is the density's
// integral over it, by adaptive quadrature; bins that expect fewer than 5 are merged. Seeds are fixed, so a test that
// passes does so for ever; the level is Sidak's [Sidak1967] for all such tests together: samplers that are all right
// would fail
// one or more of them, when they were written, with a probability of kOverallLevel.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numeric>
#include <optional>
#include <unsupported/Eigen/SpecialFunctions>
#include <utility>
#include <vector>

namespace touchstone {

inline constexpr double kOverallLevel = 0.01;
inline constexpr int kMostChiSquaredTests = 300;  ///< in all test programs together

/// Sidak's level of one test: 1 - (1 - overall)^(1 / tests), 3.4e-5.
inline double level_of_one_test() {
  return -std::expm1(std::log1p(-kOverallLevel) / kMostChiSquaredTests);
}

struct ChiSquared {
  double statistic = 0.0;
  int freedom = 0;
  double p_value = 1.0;  ///< chance of so large a statistic if counts follow what is expected
};

/// Counts against expected counts of the same bins. Bins that expect fewer than 5 are merged, the smallest first; a
/// count where nothing at all is expected gives a p-value of 0.
/// `sum_is_given`: the counts' sum follows from the expected ones, which costs a degree of freedom.
inline ChiSquared chi_squared(const std::vector<double>& counts, const std::vector<double>& expected,
                              bool sum_is_given = true) {
  constexpr double kLeastExpected = 5.0;
  std::vector<std::size_t> order(counts.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return expected[a] < expected[b]; });
  ChiSquared result;
  std::vector<std::pair<double, double>> merged;  // count, expected
  for (std::size_t bin : order) {
    if (!(expected[bin] > 0.0)) {
      if (counts[bin] > 0.0) result.p_value = 0.0;
      continue;
    }
    if (merged.empty() || merged.back().second >= kLeastExpected) merged.emplace_back(0.0, 0.0);
    merged.back().first += counts[bin];
    merged.back().second += expected[bin];
  }
  for (const auto& [count, mean] : merged) result.statistic += (count - mean) * (count - mean) / mean;
  result.freedom = static_cast<int>(merged.size()) - (sum_is_given ? 1 : 0);
  if (result.freedom < 1) result.p_value = 0.0;  // nothing was tested
  if (result.p_value > 0.0) result.p_value = Eigen::numext::igammac(0.5 * result.freedom, 0.5 * result.statistic);
  return result;
}

/// Integral over the rectangle by Gauss's rule of 3 x 3 points, cut in four at least twice (a narrow peak may lie
/// between the first points) and at most `depth` times, until cutting changes less than `most`.
inline double integrate(const std::function<double(double, double)>& f, double x0, double x1, double y0, double y1,
                        double most, int depth = 10) {
  constexpr double kNode = 0.7745966692414834;  // sqrt(3/5)
  constexpr std::array<double, 3> kNodes = {-kNode, 0.0, kNode};
  constexpr std::array<double, 3> kWeights = {5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0};
  const auto rule = [&](double a0, double a1, double b0, double b1) {
    double sum = 0.0;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        sum += kWeights[i] * kWeights[j] *
               f(0.5 * (a0 + a1) + 0.5 * (a1 - a0) * kNodes[i], 0.5 * (b0 + b1) + 0.5 * (b1 - b0) * kNodes[j]);
      }
    }
    return sum * (a1 - a0) * (b1 - b0);
  };
  const int free = depth - 2;
  const std::function<double(double, double, double, double, double, double, int)> refine =
      [&](double a0, double a1, double b0, double b1, double whole, double tolerance, int left) -> double {
    const double a = 0.5 * (a0 + a1);
    const double b = 0.5 * (b0 + b1);
    const std::array<double, 4> part = {rule(a0, a, b0, b), rule(a, a1, b0, b), rule(a0, a, b, b1), rule(a, a1, b, b1)};
    const double sum = part[0] + part[1] + part[2] + part[3];
    if (left == 0 || (left <= free && std::abs(sum - whole) < tolerance)) return sum;
    const double less = 0.5 * tolerance;
    return refine(a0, a, b0, b, part[0], less, left - 1) + refine(a, a1, b0, b, part[1], less, left - 1) +
           refine(a0, a, b, b1, part[2], less, left - 1) + refine(a, a1, b, b1, part[3], less, left - 1);
  };
  return refine(x0, x1, y0, y1, rule(x0, x1, y0, y1), most, depth);
}

struct SampleBins {
  int columns = 16;
  int rows = 16;
};

struct SampledTest {
  ChiSquared test;
  double integral = 0.0;  ///< of the density over the square
  double drawn = 0.0;     ///< share of the draws that gave a point
};

/// Draws `count` points (x, y) of the unit square, some of which may be nothing, and compares them with `density`,
/// whose integral is the share that isn't nothing. For densities of x alone use one row.
inline SampledTest test_samples(const std::function<std::optional<std::pair<double, double>>()>& draw,
                                const std::function<double(double, double)>& density, SampleBins bins = {},
                                int count = 100000) {
  const auto cells = static_cast<std::size_t>(bins.columns * bins.rows);
  std::vector<double> counts(cells + 1, 0.0);  // the last one is nothing
  for (int i = 0; i < count; ++i) {
    const auto point = draw();
    std::size_t cell = cells;
    if (point) {
      const int column = std::clamp(static_cast<int>(point->first * bins.columns), 0, bins.columns - 1);
      const int row = std::clamp(static_cast<int>(point->second * bins.rows), 0, bins.rows - 1);
      cell = static_cast<std::size_t>(row * bins.columns + column);
    }
    counts[cell] += 1.0;
  }
  SampledTest result;
  result.drawn = 1.0 - counts[cells] / count;
  std::vector<double> expected(cells + 1, 0.0);
  for (int row = 0; row < bins.rows; ++row) {
    for (int column = 0; column < bins.columns; ++column) {
      const double share =
          integrate(density, static_cast<double>(column) / bins.columns, (column + 1.0) / bins.columns,
                    static_cast<double>(row) / bins.rows, (row + 1.0) / bins.rows, 1e-5 / static_cast<double>(cells));
      expected[static_cast<std::size_t>(row * bins.columns + column)] = share * count;
      result.integral += share;
    }
  }
  // Where each draw gave a point, what quadrature leaves of one isn't a bin of its own.
  if (result.drawn < 1.0) expected[cells] = count * std::max(0.0, 1.0 - result.integral);
  result.test = chi_squared(counts, expected);
  return result;
}

/// The same as a test: the p-value above the level, and, unless draws may be nothing, a density of integral one.
inline void expect_samples(const std::function<std::optional<std::pair<double, double>>()>& draw,
                           const std::function<double(double, double)>& density, SampleBins bins = {},
                           int count = 100000, double most_off_one = 2e-4) {
  const SampledTest result = test_samples(draw, density, bins, count);
  EXPECT_GT(result.test.p_value, level_of_one_test())
      << "chi-squared " << result.test.statistic << " of " << result.test.freedom << " degrees of freedom";
  if (result.drawn == 1.0) {
    EXPECT_NEAR(result.integral, 1.0, most_off_one);
  }
}

/// Counts of a discrete variable as a test.
inline void expect_counts(const std::vector<double>& counts, const std::vector<double>& expected) {
  const ChiSquared test = chi_squared(counts, expected);
  EXPECT_GT(test.p_value, level_of_one_test())
      << "chi-squared " << test.statistic << " of " << test.freedom << " degrees of freedom";
}

}  // namespace touchstone
