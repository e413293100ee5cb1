#pragma once
// Loops whose steps are done whole or not at all.

#include <tbb/parallel_for.h>

#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>

namespace touchstone::datasets {

/// Runs step(0) ... step(count - 1), several at once. Once one of them throws no more are begun, those that are at work
/// come to their end, and the first exception is thrown. (An exception that TBB sees cancels the loops within the other
/// steps without telling them: a picture would be half there, and be kept.)
template <typename Step>
void for_each_whole(std::size_t count, const Step& step) {
  std::atomic<bool> stopped{false};
  std::mutex mutex;
  std::exception_ptr first;
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
    if (stopped) return;
    try {
      step(i);
    } catch (...) {
      const std::lock_guard<std::mutex> lock(mutex);
      if (!first) first = std::current_exception();
      stopped = true;
    }
  });
  if (first) std::rethrow_exception(first);
}

}  // namespace touchstone::datasets
