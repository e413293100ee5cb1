#include "sensors/events/grasp_phases.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/error.h"

namespace touchstone::sensors {
namespace {

/// P(Binomial(n, q) >= c), summed from its largest term on. @pre 0 < q < 1
double binomial_tail(double n, double c, double q) {
  if (c <= 0.0) return 1.0;
  if (c > n) return 0.0;
  if (c <= n * q) return 1.0;  // at least about a half, and no burst: the exact value isn't needed
  const double first = std::lgamma(n + 1.0) - std::lgamma(c + 1.0) - std::lgamma(n - c + 1.0) + c * std::log(q) +
                       (n - c) * std::log1p(-q);
  double term = std::exp(first);
  double sum = term;
  for (double k = c; k < n && term > 1e-17 * sum; k += 1.0) {
    term *= (n - k) / (k + 1.0) * q / (1.0 - q);
    sum += term;
  }
  return sum;
}

void check(const GraspPhaseSettings& settings) {
  const auto at_least = [](const char* name, std::int64_t value, std::int64_t low) {
    if (value < low) fail("grasp phases: {} is {}, it must be at least {}", name, value, low);
  };
  at_least("background_windows", settings.background_windows, 2);
  if (!(settings.false_alarm > 0.0 && settings.false_alarm < 0.5)) {
    fail("grasp phases: false_alarm is {}, it must be above 0 and below 0.5", settings.false_alarm);
  }
  at_least("least_events", settings.least_events, 1);
  at_least("grasp_windows", settings.grasp_windows, 1);
  at_least("least_hold_windows", settings.least_hold_windows, settings.background_windows);
  at_least("release_windows", settings.release_windows, 1);
}

std::vector<std::int64_t> counts_of(std::span<const EventCounts> windows, std::int64_t EventCounts::*kind) {
  std::vector<std::int64_t> counts;
  for (const EventCounts& window : windows) counts.push_back(window.*kind);
  return counts;
}

}  // namespace

std::int64_t burst_threshold(std::span<const std::int64_t> background, double false_alarm) {
  TS_ASSERT(background.size() >= 2 && false_alarm > 0.0 && false_alarm < 0.5);
  const auto windows = static_cast<double>(background.size());
  double sum = 0.0;
  for (const std::int64_t count : background) {
    TS_ASSERT(count >= 0);
    sum += static_cast<double>(count);
  }
  const double mean = sum / windows;
  double variance = 0.0;
  for (const std::int64_t count : background) {
    variance += (static_cast<double>(count) - mean) * (static_cast<double>(count) - mean) / (windows - 1.0);
  }
  const double spread = mean > 0.0 ? std::max(1.0, variance / mean) : 1.0;
  const double known = std::ceil(sum / spread);
  const auto is_burst = [&](double count) {
    const double scaled = std::floor(count / spread);
    return binomial_tail(known + scaled, scaled, 1.0 / (windows + 1.0)) < false_alarm;
  };
  double high = 1.0;
  while (!is_burst(high)) high *= 2.0;
  double low = std::floor(high / 2.0);  // no burst
  while (high - low > 1.0) {
    const double middle = std::floor(0.5 * (low + high));
    (is_burst(middle) ? high : low) = middle;
  }
  return static_cast<std::int64_t>(high);
}

std::int64_t touch_threshold_of(std::span<const EventCounts> background, const GraspPhaseSettings& settings) {
  check(settings);
  if (background.size() < 2) fail("grasp phases: {} windows of background, at least 2 are needed", background.size());
  return std::max(settings.least_events,
                  burst_threshold(counts_of(background, &EventCounts::off), settings.false_alarm));
}

int find_first_touch(std::span<const EventCounts> windows, const GraspPhaseSettings& settings) {
  check(settings);
  const auto background = static_cast<std::size_t>(settings.background_windows);
  if (windows.size() <= background) {
    fail("grasp phases: {} windows; more than the {} of the background are needed", windows.size(), background);
  }
  const std::int64_t threshold = touch_threshold_of(windows.first(background), settings);
  for (std::size_t i = background; i < windows.size(); ++i) {
    if (windows[i].off >= threshold) return static_cast<int>(i);
  }
  return -1;
}

GraspPhases find_grasp_phases(std::span<const EventCounts> windows, const GraspPhaseSettings& settings) {
  GraspPhases phases;
  phases.first_touch = find_first_touch(windows, settings);
  const auto background = static_cast<std::size_t>(settings.background_windows);
  phases.touch_threshold = touch_threshold_of(windows.first(background), settings);
  if (phases.first_touch < 0) {
    std::int64_t most = 0;
    for (const EventCounts& window : windows.subspan(background)) most = std::max(most, window.off);
    fail("grasp phases: there is no touch: no window has {} OFF events, which a burst would have; the most are {}",
         phases.touch_threshold, most);
  }
  phases.hold_begin = phases.first_touch + settings.grasp_windows;
  const std::int64_t first = static_cast<std::int64_t>(phases.hold_begin) + settings.least_hold_windows;
  const auto total = static_cast<std::int64_t>(windows.size());
  if (first >= total) {
    fail("grasp phases: after the touch in window {} the recording has {} windows; more than {} are needed",
         phases.first_touch, total - phases.first_touch, settings.grasp_windows + settings.least_hold_windows);
  }
  for (std::int64_t i = first; i < total; ++i) {
    const auto before = windows.subspan(static_cast<std::size_t>(i) - background, background);
    const EventCounts& window = windows[static_cast<std::size_t>(i)];
    if (window.on < settings.least_events) continue;
    const std::int64_t threshold =
        std::max(settings.least_events, burst_threshold(counts_of(before, &EventCounts::on), settings.false_alarm));
    if (window.on < threshold) continue;
    phases.release_begin = static_cast<int>(i);
    phases.release_threshold = threshold;
    if (i + settings.release_windows > total) {
      fail("grasp phases: the release begins in window {} and the recording ends {} windows later; {} are needed", i,
           total - i, settings.release_windows);
    }
    phases.release_end = phases.release_begin + settings.release_windows;
    return phases;
  }
  fail("grasp phases: there is no release: no window from {} to {} has a burst of ON events", first, total - 1);
}

}  // namespace touchstone::sensors
