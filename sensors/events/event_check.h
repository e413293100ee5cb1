#pragma once
// The check that every event passes when it is read from or written to a file.

#include <cstdint>
#include <limits>
#include <opencv2/core/types.hpp>
#include <span>
#include <string>

#include "core/frame.h"

namespace touchstone::sensors {

/// Takes events one after the other: none may lie beside the picture or be earlier than the one before it.
class EventCheck {
 public:
  /// @param file stands in messages
  /// @param size of the camera, or the largest that the format can hold, pixels
  EventCheck(std::string file, cv::Size size) : file_(std::move(file)), size_(size) {}

  cv::Size size() const { return size_; }
  std::int64_t seen() const { return seen_; }
  /// Whether the next event may be this one.
  bool takes(const Event& event) const {
    return event.t_us >= last_us_ && event.x < size_.width && event.y < size_.height;
  }
  /// @pre takes(event)
  void take(const Event& event) {
    last_us_ = event.t_us;
    ++seen_;
  }
  /// Takes all. @throws Error naming file, the event's number from 0 on, its values and what is allowed
  void pass(std::span<const Event> events);
  /// Says what is wrong with an event that isn't taken. `where` stands for its place in the file.
  [[noreturn]] void refuse(const Event& event, const std::string& where) const;

 private:
  std::string file_;
  cv::Size size_;
  std::int64_t seen_ = 0;
  std::int64_t last_us_ = std::numeric_limits<std::int64_t>::min();
};

}  // namespace touchstone::sensors
