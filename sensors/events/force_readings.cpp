#include "sensors/events/force_readings.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace touchstone::sensors {
namespace {

/// The force at a moment.
double force_at(const ForceReadings& readings, double t_us) {
  const auto after =
      std::ranges::upper_bound(readings.t_us, t_us, {}, [](std::int64_t t) { return static_cast<double>(t); });
  const auto i = static_cast<std::size_t>(after - readings.t_us.begin());
  if (i == 0) return readings.force_N.front();
  if (after == readings.t_us.end()) return readings.force_N.back();
  const auto before_us = static_cast<double>(readings.t_us[i - 1]), after_us = static_cast<double>(readings.t_us[i]);
  const double part = (t_us - before_us) / (after_us - before_us);
  return (1.0 - part) * readings.force_N[i - 1] + part * readings.force_N[i];
}

}  // namespace

std::string fault_of(const ForceReadings& readings) {
  if (readings.t_us.empty()) return "there are no forces";
  if (readings.t_us.size() != readings.force_N.size()) {
    return fmt::format("{} times have {} forces", readings.t_us.size(), readings.force_N.size());
  }
  for (std::size_t i = 0; i < readings.t_us.size(); ++i) {
    if (!std::isfinite(readings.force_N[i])) return fmt::format("force {} is {}", i, readings.force_N[i]);
    if (i > 0 && readings.t_us[i] <= readings.t_us[i - 1]) {
      return fmt::format("force {} is of {} us, the one before of {} us", i, readings.t_us[i], readings.t_us[i - 1]);
    }
  }
  return {};
}

double mean_force_N(const ForceReadings& readings, std::int64_t from_us, std::int64_t to_us) {
  TS_ASSERT(fault_of(readings).empty() && from_us < to_us);
  // Trapezia between the ends and the readings that lie between them: exact for a course of straight parts.
  auto next = std::ranges::upper_bound(readings.t_us, from_us);
  auto t_us = static_cast<double>(from_us);
  double force_N = force_at(readings, t_us), sum = 0.0;
  const auto go_to = [&](double then_us) {
    const double then_N = force_at(readings, then_us);
    sum += 0.5 * (force_N + then_N) * (then_us - t_us);
    t_us = then_us;
    force_N = then_N;
  };
  for (; next != readings.t_us.end() && *next < to_us; ++next) go_to(static_cast<double>(*next));
  go_to(static_cast<double>(to_us));
  return sum / static_cast<double>(to_us - from_us);
}

}  // namespace touchstone::sensors
