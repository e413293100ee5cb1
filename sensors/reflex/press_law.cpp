#include "sensors/reflex/press_law.h"

#include <Eigen/Core>
#include <algorithm>
#include <limits>

#include "core/dense_solvers.h"
#include "core/error.h"

namespace touchstone::sensors {

DilationPress fit_dilation_press(std::span<const DilationSample> samples, int terms) {
  if (terms < 1 || terms > 3) fail("dilation and press: {} terms; 1 to 3 are known", terms);
  if (samples.size() < 3 * static_cast<std::size_t>(terms)) {
    fail("dilation and press: {} samples, at least {} are needed", samples.size(), 3 * terms);
  }
  const auto count = static_cast<Eigen::Index>(samples.size());
  Eigen::MatrixXd powers(count, terms);
  Eigen::VectorXd press(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const DilationSample& one = samples[static_cast<std::size_t>(i)];
    if (!(one.dilation > 0.0) || !std::isfinite(one.dilation) || !std::isfinite(one.press_mm)) {
      fail("dilation and press: sample {} is ({}, {} mm); a dilation above 0 and finite numbers are needed", i,
           one.dilation, one.press_mm);
    }
    const double nearer = 1.0 - 1.0 / one.dilation;
    for (int k = 0; k < terms; ++k) powers(i, k) = std::pow(nearer, k + 1);
    press[i] = one.press_mm;
  }
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> factors(powers);
  if (factors.rank() < terms) fail("dilation and press: the samples' dilations are too few different ones");
  const Eigen::VectorXd solution = factors.solve(press);
  DilationPress law;
  law.terms = terms;
  for (int k = 0; k < terms; ++k) law.mm[static_cast<std::size_t>(k)] = solution[k];
  double squares = 0.0;
  for (const DilationSample& one : samples) squares += std::pow(law.press_mm(one.dilation) - one.press_mm, 2);
  law.rms_residual_mm = std::sqrt(squares / static_cast<double>(count));
  return law;
}

ExponentialForce fit_exponential_force(std::span<const PressSample> samples) {
  constexpr double kLeastRate = 1e-3, kMostRate = 10.0;  // per mm
  constexpr int kPlaces = 400;
  if (samples.size() < 4) fail("exponential law: {} samples, at least 4 are needed", samples.size());
  double least_mm = std::numeric_limits<double>::infinity(), most_mm = 0.0;  // of what presses
  for (const PressSample& one : samples) {
    if (!std::isfinite(one.press_mm) || !std::isfinite(one.force_N)) {
      fail("exponential law: a sample is ({} mm, {} N); finite numbers are needed", one.press_mm, one.force_N);
    }
    if (one.press_mm <= 0.0) continue;
    least_mm = std::min(least_mm, one.press_mm);
    most_mm = std::max(most_mm, one.press_mm);
  }
  if (!(most_mm > 0.0)) fail("exponential law: no press is above 0 mm; two different ones are needed");
  if (most_mm - least_mm <= 1e-9 * most_mm) {
    fail("exponential law: all presses above 0 are {} mm; two different ones are needed", most_mm);
  }
  // For a given rate the scale is linear; the rate is sought on a grid first, so that the best of all is found.
  const auto law_of = [&](double rate) {
    ExponentialForce law{0.0, rate, 0.0};
    double xx = 0.0, xy = 0.0;
    for (const PressSample& one : samples) {
      const double x = one.press_mm > 0.0 ? std::expm1(rate * one.press_mm) : 0.0;
      xx += x * x;
      xy += x * one.force_N;
    }
    law.scale_N = xx > 0.0 ? xy / xx : 0.0;
    double squares = 0.0;
    for (const PressSample& one : samples) squares += std::pow(law.force_N(one.press_mm) - one.force_N, 2);
    law.rms_residual_N = std::sqrt(squares / static_cast<double>(samples.size()));
    return law;
  };
  const double step = std::pow(kMostRate / kLeastRate, 1.0 / kPlaces);
  int best = -1;
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i <= kPlaces; ++i) {
    const double residual = law_of(kLeastRate * std::pow(step, i)).rms_residual_N;
    if (residual < least) {
      least = residual;
      best = i;
    }
  }
  if (best <= 0 || best >= kPlaces) fail("exponential law: no rate from {} to {} per mm fits", kLeastRate, kMostRate);
  double low = kLeastRate * std::pow(step, best - 1), high = kLeastRate * std::pow(step, best + 1);
  const double golden = 0.5 * (std::sqrt(5.0) - 1.0);
  while (high - low > 1e-10 * high) {
    const double left = high - golden * (high - low), right = low + golden * (high - low);
    if (law_of(left).rms_residual_N <= law_of(right).rms_residual_N) {
      high = right;
    } else {
      low = left;
    }
  }
  const ExponentialForce law = law_of(0.5 * (low + high));
  if (!(law.scale_N > 0.0)) fail("exponential law: the forces fall with the press");
  return law;
}

}  // namespace touchstone::sensors
