#include "sim/grasp/reference_force_sensor.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.h"
#include "core/random.h"

namespace touchstone::sim {
namespace {

constexpr int kPlays = 64;
constexpr double kFinest = 1e-3;    // of the scale: the smallest threshold
constexpr double kCoarsest = 10.0;  // likewise the largest
constexpr double kScale_N = 3.7;    // the range of [Naeini2020], for which the loop is normalised
constexpr double kTonnesPerGram = 1e-6;
constexpr std::array<double, 4> kDriftTimes_s = {0.1, 1.0, 10.0, 100.0};
constexpr double kDriftRightAfter_s = 1.0;

void check_within(double value, double low, double high, const char* name) {
  if (!(value >= low) || !(value <= high)) {
    fail("the force sensor's {} is {}, it must be from {} to {}", name, value, low, high);
  }
}

void check_all(const ReferenceForceSensorSettings& s) {
  check_within(s.window_s, 1e-4, 10.0, "window_s");
  check_within(s.hysteresis, 0.0, 0.45, "hysteresis");
  check_within(s.gain_error, 0.0, 0.5, "gain_error");
  check_within(s.drift_per_decade, 0.0, 0.5, "drift_per_decade");
  check_within(s.lag_s, 0.0, 10.0, "lag_s");
  check_within(s.full_scale_N, 1e-3, 1e6, "full_scale_N");
  check_within(s.adc_bits, 0, 24, "adc_bits");
  check_within(s.noise_N, 0.0, 1e3, "noise_N");
  check_within(s.carried_g, 0.0, 1e4, "carried_g");
  check_within(s.shaken_N_s_mm, 0.0, 1e3, "shaken_N_s_mm");
  check_within(s.median, 1, 99, "median");
  if (s.median % 2 == 0) fail("the force sensor's median is {}, it must be odd", s.median);
}

/// Reading over force that creeps up by a share per decade.
class Drift {
 public:
  explicit Drift(double per_decade) : per_decade_(per_decade) {
    right_ = 1.0;
    for (const double time : kDriftTimes_s) right_ += per_decade_ * -std::expm1(-kDriftRightAfter_s / time);
  }
  double next(double value, double seconds) {
    double sum = value;
    for (std::size_t k = 0; k < kDriftTimes_s.size(); ++k) {
      crept_[k] += -std::expm1(-seconds / kDriftTimes_s[k]) * (value - crept_[k]);
      sum += per_decade_ * crept_[k];
    }
    return sum / right_;
  }

 private:
  double per_decade_, right_;
  std::array<double, kDriftTimes_s.size()> crept_{};
};

std::vector<double> median_of(const std::vector<ForceReading>& readings, int width) {
  std::vector<double> result;
  const auto count = static_cast<long>(readings.size());
  for (long k = 0; k < count; ++k) {
    std::vector<double> around;
    for (long i = k - width / 2; i <= k + width / 2; ++i) {
      around.push_back(readings[static_cast<std::size_t>(std::clamp(i, 0L, count - 1))].raw_N);
    }
    std::nth_element(around.begin(), around.begin() + width / 2, around.end());
    result.push_back(around[static_cast<std::size_t>(width / 2)]);
  }
  return result;
}

}  // namespace

HysteresisLoop::HysteresisLoop(double width, double scale) {
  if (!(width >= 0.0) || !(width < 0.5)) fail("a hysteresis of {} is asked for, it must be from 0 to below 0.5", width);
  if (!(scale > 0.0) || !std::isfinite(scale)) fail("a hysteresis' scale is {}, it must be above 0 and finite", scale);
  if (width == 0.0) {
    threshold_ = play_ = {0.0};
    weight_ = {1.0};
    return;
  }
  const double alpha = 1.0 - std::log2(1.0 - width);
  // The first loading, linear between the thresholds; each play adds its change of slope.
  const auto loading = [&](double force) { return scale * std::pow(force / scale, alpha); };
  double last = 0.0;
  double slope = 0.0;
  for (int k = 0; k < kPlays; ++k) {
    const double next = scale * kFinest * std::pow(kCoarsest / kFinest, static_cast<double>(k) / (kPlays - 1));
    const double steeper = (loading(next) - loading(last)) / (next - last);
    threshold_.push_back(last);
    weight_.push_back(steeper - slope);
    slope = steeper;
    last = next;
  }
  play_.assign(threshold_.size(), 0.0);
}

double HysteresisLoop::next(double force) {
  double sum = 0.0;
  for (std::size_t k = 0; k < play_.size(); ++k) {
    play_[k] = std::clamp(play_[k], force - threshold_[k], force + threshold_[k]);
    sum += weight_[k] * play_[k];
  }
  return sum;
}

std::vector<ForceReading> read_reference_force(std::span<const FingerMoment> moments, double from_s,
                                               const ReferenceForceSensorSettings& settings, std::uint64_t seed) {
  check_all(settings);
  if (moments.size() < 2) fail("a force sensor needs at least two moments, {} are given", moments.size());
  const double dt = moments[1].seconds - moments[0].seconds;
  for (std::size_t k = 1; k < moments.size(); ++k) {
    if (!(std::abs(moments[k].seconds - moments[k - 1].seconds - dt) <= 1e-6 * dt) || !(dt > 0.0)) {
      fail("the moments that a force sensor is given aren't even in time: moment {} is at {} s, the one before at {} s",
           k, moments[k].seconds, moments[k - 1].seconds);
    }
  }
  if (!(from_s >= moments.front().seconds) || !(from_s + settings.window_s <= moments.back().seconds + 0.5 * dt)) {
    fail("no window of {} s from {} s on fits into a grasp from {} to {} s", settings.window_s, from_s,
         moments.front().seconds, moments.back().seconds);
  }
  RandomStream numbers(seed, 0, Purpose::kForceSensor);
  const double gain = 1.0 + settings.gain_error * (2.0 * numbers.uniform() - 1.0);
  const double least_step = settings.adc_bits > 0 ? settings.full_scale_N / (std::exp2(settings.adc_bits) - 1.0) : 0.0;
  const double follow = settings.lag_s > 0.0 ? -std::expm1(-dt / settings.lag_s) : 1.0;
  HysteresisLoop loop(settings.hysteresis, kScale_N);
  Drift drift(settings.drift_per_decade);

  std::vector<ForceReading> readings;
  double lagging = 0.0;
  double sum = 0.0;
  int count = 0;
  for (const FingerMoment& moment : moments) {
    const double inertia = settings.carried_g * kTonnesPerGram * moment.acceleration_mm_s2;
    lagging += follow * (moment.force_N + inertia - lagging);
    const double value = gain * drift.next(loop.next(lagging), dt);
    if (moment.seconds < from_s) continue;
    sum += moment.force_N;
    ++count;
    const double end = from_s + static_cast<double>(readings.size() + 1) * settings.window_s;
    if (moment.seconds + 0.5 * dt < end) continue;
    const double spread = std::hypot(settings.noise_N, settings.shaken_N_s_mm * moment.speed_mm_s);
    double raw = value + spread * numbers.normal();
    if (least_step > 0.0) raw = least_step * std::round(std::clamp(raw, 0.0, settings.full_scale_N) / least_step);
    readings.push_back({end, sum / count, raw, 0.0});
    sum = 0.0;
    count = 0;
  }
  const std::vector<double> filtered = median_of(readings, settings.median);
  for (std::size_t k = 0; k < readings.size(); ++k) readings[k].measured_N = filtered[k];
  return readings;
}

}  // namespace touchstone::sim
