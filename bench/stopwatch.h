#pragma once
// Seconds on the clock and of all processors.

#include <chrono>
#include <ctime>

namespace touchstone::bench {

class Stopwatch {
 public:
  double seconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - begun_).count(); }

 private:
  std::chrono::steady_clock::time_point begun_ = std::chrono::steady_clock::now();
};

/// Seconds of all processors that this process has used since this was made: what others on the machine take doesn't
/// count.
class ProcessorStopwatch {
 public:
  double seconds() const { return used() - begun_; }

 private:
  static double used() {
    timespec now{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
  }
  double begun_ = used();
};

}  // namespace touchstone::bench
