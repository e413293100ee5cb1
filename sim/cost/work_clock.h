#pragma once

#include <algorithm>
#include <chrono>

#include "core/seconds_since.h"

namespace touchstone::sim {

/// Seconds of this process's work since it was made: those on the clock, or those that its threads have worked where
/// that is less, as on one thread of a machine on which others are at work.
class WorkClock {
 public:
  double seconds() const { return std::min(seconds_since(begun_), core_seconds() - worked_); }

 private:
  std::chrono::steady_clock::time_point begun_ = std::chrono::steady_clock::now();
  double worked_ = core_seconds();
};

}  // namespace touchstone::sim
