#include "lab/vhs/rule_reading.h"

#include <Eigen/Core>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <complex>

#include "core/error.h"
#include "core/units.h"

namespace touchstone::lab {
namespace {

/// Values over their parabola, less one.
Eigen::VectorXd levelled(const RuleProfile& profile) {
  const auto n = static_cast<Eigen::Index>(profile.values.size());
  TS_ASSERT(n > 3);
  const Eigen::VectorXd values = Eigen::Map<const Eigen::VectorXd>(profile.values.data(), n);
  Eigen::MatrixX3d powers(n, 3);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double t = 2.0 * static_cast<double>(i) / static_cast<double>(n - 1) - 1.0;
    powers.row(i) << 1.0, t, t * t;
  }
  const Eigen::Vector3d fit = powers.colPivHouseholderQr().solve(values);
  return values.cwiseQuotient(powers * fit).array() - 1.0;
}

double place(const RuleProfile& profile, Eigen::Index i) {
  return profile.from_mm + profile.step_mm * static_cast<double>(i);
}

/// Amplitude and phase of a wave under a Hann window.
std::complex<double> wave(const RuleProfile& profile, const Eigen::VectorXd& values, double per_mm) {
  std::complex<double> sum = 0.0;
  double weights = 0.0;
  const auto n = values.size();
  for (Eigen::Index i = 0; i < n; ++i) {
    const double weight = 1.0 - std::cos(2.0 * kPi * (static_cast<double>(i) + 0.5) / static_cast<double>(n));
    sum += weight * values[i] * std::polar(1.0, -2.0 * kPi * per_mm * place(profile, i));
    weights += weight;
  }
  return 2.0 * sum / weights;
}

}  // namespace

RuleReading read_rule(const RuleProfile& profile, double slowest, double fastest) {
  constexpr int kOversampling = 8;
  constexpr double kPeak = 3.0;  // half of what a peak takes under the window, in waves per length
  const Eigen::VectorXd values = levelled(profile);
  const double length = profile.length_mm();
  std::vector<double> at;
  std::vector<double> amplitude;
  for (double f = slowest; f <= fastest; f += 1.0 / (kOversampling * length)) {
    at.push_back(f);
    amplitude.push_back(std::abs(wave(profile, values, f)));
  }
  const auto best = static_cast<std::size_t>(std::max_element(amplitude.begin(), amplitude.end()) - amplitude.begin());
  RuleReading reading;
  reading.lines_per_mm = at[best];
  const std::complex<double> strongest = wave(profile, values, at[best]);
  reading.contrast = std::abs(strongest);
  // Re(strongest e^(i 2 pi f x)) is least where the whole phase is pi.
  const double turns = (kPi - std::arg(strongest)) / (2.0 * kPi) - at[best] * profile.from_mm;
  reading.dark_mm = profile.from_mm + (turns - std::floor(turns)) / at[best];
  std::vector<double> others;  // not the peak and not its harmonics
  for (std::size_t k = 0; k < at.size(); ++k) {
    const double harmonic = std::max(1.0, std::round(at[k] / at[best]));
    if (std::abs(at[k] - harmonic * at[best]) * length > kPeak) others.push_back(amplitude[k]);
  }
  if (!others.empty()) {
    const auto middle = others.begin() + static_cast<std::ptrdiff_t>(others.size() / 2);
    std::nth_element(others.begin(), middle, others.end());
    reading.noise = *middle;
  }
  return reading;
}

double contrast_at(const RuleProfile& profile, double lines_per_mm, double line_mm) {
  const Eigen::VectorXd values = levelled(profile);
  const auto periods = std::floor(profile.length_mm() * lines_per_mm + 1e-9);
  TS_ASSERT(periods >= 1.0);
  const auto n =
      std::min(values.size(), static_cast<Eigen::Index>(std::llround(periods / lines_per_mm / profile.step_mm)));
  Eigen::MatrixX3d waves(n, 3);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double phase = 2.0 * kPi * lines_per_mm * (place(profile, i) - line_mm);
    waves.row(i) << 1.0, std::cos(phase), std::sin(phase);
  }
  const Eigen::Vector3d fit = waves.colPivHouseholderQr().solve(values.head(n));
  return -fit[1] / (1.0 + fit[0]);
}

bool reads(const RuleReading& reading, const RuleProfile& profile, double true_pitch_mm, double line_mm) {
  const double counted = reading.lines_per_mm * profile.length_mm();
  const double there = profile.length_mm() / true_pitch_mm;
  const double off = std::remainder(reading.dark_mm - line_mm, true_pitch_mm);
  return reading.contrast > kClearWave * reading.noise && std::abs(counted - there) < 0.5 &&
         std::abs(off) < 0.25 * true_pitch_mm;
}

}  // namespace touchstone::lab
