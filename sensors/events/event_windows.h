#pragma once
// Events to counts: [Naeini2020, sec. III.B], "framed over 7 ms intervals", ON and OFF apart (III.C).

#include <cstdint>
#include <opencv2/core/types.hpp>
#include <span>
#include <vector>

#include "core/frame.h"

namespace touchstone::sensors {

/// Events of one window.
struct EventCounts {
  std::int64_t on = 0;
  std::int64_t off = 0;

  bool operator==(const EventCounts&) const = default;
};

/// Which events are counted, and over what times.
struct EventWindowSettings {
  std::int64_t start_us = 0;       ///< of the first window
  std::int64_t length_us = 7'000;  ///< of each; the paper's 7 ms
  cv::Size size{240, 180};         ///< of the camera, px (DAVIS 240C)
  cv::Rect region = {};            ///< only its pixels count; empty: all
};

/// Counts events that come in portions. Window i is [start + i length, start + (i + 1) length); a window without events
/// has zeros. However the events are portioned, the windows are the same. What comes before the start isn't counted.
class EventWindows {
 public:
  /// A time so far on that there would be more windows is refused: it's damaged.
  static constexpr std::int64_t kMostWindows = 10'000'000;

  /// @throws Error naming the setting that is out of its range (a region must lie within the picture)
  explicit EventWindows(const EventWindowSettings& settings);

  /// Takes the next events, in order of time. @throws Error naming the event (its number since the beginning) whose
  /// time goes backwards, or is too far on, or whose pixel isn't the camera's; those before it have been counted, and
  /// it and what follows haven't
  void add(std::span<const Event> events);

  /// Says that no event before `t_us` is to come: windows that end by then are finished.
  /// @throws Error if windows up to then would be too many
  void end_at(std::int64_t t_us);

  /// All windows that no event can enter any more.
  std::span<const EventCounts> finished() const { return finished_; }
  std::int64_t events() const { return events_; }                ///< given so far
  std::int64_t before_start() const { return before_start_; }    ///< of these, before the first window
  std::int64_t beside_region() const { return beside_region_; }  ///< of these, outside of the region

 private:
  std::int64_t window_at(std::int64_t t_us) const;
  void finish_before(std::int64_t window);

  EventWindowSettings settings_;
  std::vector<EventCounts> finished_;
  EventCounts open_;  ///< the window after the finished ones
  std::int64_t last_us_;
  std::int64_t events_ = 0;
  std::int64_t before_start_ = 0;
  std::int64_t beside_region_ = 0;
};

/// The windows of a whole recording that ends at `end_us`; a last window that isn't whole is left out.
/// @throws Error as EventWindows, and if an event isn't before the end
std::vector<EventCounts> count_windows(std::span<const Event> events, const EventWindowSettings& settings,
                                       std::int64_t end_us);

}  // namespace touchstone::sensors
