#pragma once

#include <cstdint>
#include <limits>
#include <optional>

#include "core/error.h"

namespace touchstone::python {

/// Times of frames of which some may come without one: then as long after the last one as that was after the one
/// before.
class FrameClock {
 public:
  /// When the next frame is. @param t_us as given; none: to be made up, 0 for the first. @throws Error where that is
  /// beyond the largest number
  std::int64_t time_of_next(const std::optional<std::int64_t>& t_us) const {
    if (t_us) return *t_us;
    if (last_us_ == kBeforeAll) return 0;
    if (last_us_ > std::numeric_limits<std::int64_t>::max() - step_us_) {
      fail("t_us: it must be given, the last frame's {} us are too near to the largest number", last_us_);
    }
    return last_us_ + step_us_;
  }

  /// A frame of that time was taken.
  void note(std::int64_t now_us) {
    // Unsigned: times may lie so far apart that their difference is no number.
    const auto passed = static_cast<std::uint64_t>(now_us) - static_cast<std::uint64_t>(last_us_);
    if (last_us_ != kBeforeAll && passed <= kLongest_us) step_us_ = static_cast<std::int64_t>(passed);
    last_us_ = now_us;
  }

 private:
  static constexpr std::int64_t kBeforeAll = std::numeric_limits<std::int64_t>::min();
  static constexpr std::uint64_t kLongest_us = std::numeric_limits<std::int64_t>::max();
  std::int64_t last_us_ = kBeforeAll, step_us_ = 1;
};

}  // namespace touchstone::python
