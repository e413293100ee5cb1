#pragma once
// Noise by inversion: one uniform number gives one noisy value, monotonic in the uniform number and in the mean.
// Rejection methods draw a varying number of times, which would make a pixel's noise jump when its light changes a
// little.

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace touchstone::render {

/// Where normal_quantile's first approximation ends, from the middle u = 1/2.
constexpr double kCentralNormal = 0.425;

/// normal_quantile(1/2 + q) for |q| <= kCentralNormal; otherwise a number without meaning. No branch and no call, for
/// loops over many.
inline double central_normal_quantile(double q) {
  const double r = 0.180625 - q * q;
  return q * (((59.109374720 * r + 159.29113202) * r + 50.434271938) * r + 3.3871327179) /
         (((67.187563600 * r + 78.757757664) * r + 17.895169469) * r + 1.0);
}

/// The standard normal's value below which a share u lies, to a relative 1e-6. Rational approximations of
/// [Wichura1988], the short form PPND7.
/// u in [0, 1]; the ends give about +-8.2 standard deviations, not infinity.
inline double normal_quantile(double u) {
  const double q = u - 0.5;
  if (std::abs(q) <= kCentralNormal) return central_normal_quantile(q);
  const double tail = std::max(q < 0.0 ? u : 1.0 - u, 0x1.0p-53);
  const double r = std::sqrt(-std::log(tail));
  double value;
  if (r <= 5.0) {
    const double s = r - 1.6;
    value = (((0.17023821103 * s + 1.3067284816) * s + 2.7568153900) * s + 1.4234372777) /
            ((0.12021132975 * s + 0.73700164250) * s + 1.0);
  } else {
    const double s = r - 5.0;
    value = (((0.017337203997 * s + 0.42868294337) * s + 3.0812263860) * s + 6.6579051150) /
            ((0.012258202635 * s + 0.24197894225) * s + 1.0);
  }
  return q < 0.0 ? -value : value;
}

/// Below this mean poisson_quantile sums up.
constexpr double kFewCounts = 32.0;

/// Not yet a whole number: poisson_quantile() of a mean from kFewCounts is this rounded down, or 0 below that. `w` is
/// the normal_quantile of the share. No branch and no call.
inline double many_counts(double mean, double w) {
  const double root = std::sqrt(mean);
  const double inverse_root = 1.0 / root;
  const double w2 = w * w;
  const double second = (w2 * (3.0 * w2 + 7.0) * (1.0 / 810.0) - 8.0 / 405.0) * inverse_root;
  const double first = (second - w * (2.0 + w2) * (1.0 / 72.0)) * inverse_root;
  return mean + root * w + (1.0 / 3.0 + w2 * (1.0 / 6.0)) + first;
}

/// The smallest whole number at or below which a share u of a Poisson distribution lies. Exact by summing up to a mean
/// of 32; above, the Cornish-Fisher expansion to O(1/mean) ([Giles2016], equation of the normal asymptotic), which
/// gives the neighbouring number for less than one u in a thousand. @pre mean >= 0 and finite, u in [0, 1)
inline double poisson_quantile(double mean, double u) {
  if (mean < kFewCounts) {
    double share = std::exp(-mean);
    double below = share;
    double count = 0.0;
    while (u >= below && count < 200.0) {  // beyond 200 the share is below 1e-70
      count += 1.0;
      share *= mean / count;
      below += share;
    }
    return count;
  }
  const double continuous = many_counts(mean, normal_quantile(u));
  // Truncation is the floor of what isn't negative, and costs no call.
  return continuous <= 0.0 ? 0.0 : static_cast<double>(static_cast<std::int64_t>(continuous));
}

}  // namespace touchstone::render
