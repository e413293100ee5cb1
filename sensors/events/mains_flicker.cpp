#include "sensors/events/mains_flicker.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/units.h"

namespace touchstone::sensors {
namespace {

constexpr std::uint64_t kBlock_us = 250'000;

/// P(gamma distributed of this whole shape >= x).
double gamma_tail(int shape, double x) {
  double sum = 0.0;
  double log_term = -x;  // x^k exp(-x) / k!
  for (int k = 0; k < shape; ++k) {
    sum += std::exp(log_term);
    log_term += std::log(x / (k + 1.0));
  }
  return std::min(1.0, sum);
}

}  // namespace

void MainsFlickerMeter::close(Sums& sums, std::int64_t events) {
  if (events == 0) return;
  sums.z += std::norm(sums.open) / static_cast<double>(events);
  sums.length += std::abs(sums.open);
  sums.open = 0.0;
}

void MainsFlickerMeter::add(std::span<const Event> events) {
  for (const Event& event : events) {
    if (events_ > 0 && event.t_us < last_us_) {
      fail("event {}: its time is {} us, that of the one before is {} us; times must not go backwards", events_,
           event.t_us, last_us_);
    }
    if (events_ == 0) block_us_ = event.t_us;
    // Unsigned, since the time between may be more than a signed number holds.
    std::uint64_t since = static_cast<std::uint64_t>(event.t_us) - static_cast<std::uint64_t>(block_us_);
    if (since >= kBlock_us) {
      for (Sums& sums : sums_) close(sums, open_events_);
      ++blocks_;
      open_events_ = 0;
      block_us_ = event.t_us;
      since = 0;
    }
    const double seconds = static_cast<double>(since) / kMicrosecondsPerSecond;
    for (std::size_t k = 0; k < sums_.size(); ++k) {
      sums_[k].open += std::polar(event.on ? 1.0 : -1.0, 2.0 * kPi * kFrequencies_Hz[k] * seconds);
    }
    last_us_ = event.t_us;
    ++events_;
    ++open_events_;
  }
}

MainsFlicker MainsFlickerMeter::flicker() const {
  MainsFlicker found;
  found.events = events_;
  if (events_ == 0) return found;
  double most = -1.0;
  for (std::size_t k = 0; k < sums_.size(); ++k) {
    Sums sums = sums_[k];
    close(sums, open_events_);
    if (sums.z <= most) continue;
    most = sums.z;
    found.frequency_Hz = kFrequencies_Hz[k];
    found.share = sums.length / static_cast<double>(events_);
  }
  found.chance = std::min(1.0, static_cast<double>(sums_.size()) * gamma_tail(blocks_ + 1, most));
  return found;
}

}  // namespace touchstone::sensors
