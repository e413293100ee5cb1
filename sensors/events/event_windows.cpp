#include "sensors/events/event_windows.h"

#include <limits>

#include "core/error.h"

namespace touchstone::sensors {

EventWindows::EventWindows(const EventWindowSettings& settings)
    : settings_(settings), last_us_(std::numeric_limits<std::int64_t>::min()) {
  if (settings_.length_us < 1) fail("event windows: length_us is {}, it must be at least 1", settings_.length_us);
  constexpr std::int64_t kFarthest = std::numeric_limits<std::int64_t>::max() / 4;
  if (settings_.start_us < -kFarthest || settings_.start_us > kFarthest || settings_.length_us > kFarthest) {
    fail("event windows: start_us {} and length_us {} must be within {}", settings_.start_us, settings_.length_us,
         kFarthest);
  }
  if (settings_.size.width < 1 || settings_.size.height < 1) {
    fail("event windows: a camera of {} x {} px; it must have pixels", settings_.size.width, settings_.size.height);
  }
  const cv::Rect picture({0, 0}, settings_.size);
  if (settings_.region.empty()) {
    settings_.region = picture;
  } else if ((settings_.region & picture) != settings_.region) {
    fail("event windows: a region of {} x {} px at ({}, {}); it must lie within the {} x {} px of the camera",
         settings_.region.width, settings_.region.height, settings_.region.x, settings_.region.y, settings_.size.width,
         settings_.size.height);
  }
}

std::int64_t EventWindows::window_at(std::int64_t t_us) const {
  if (t_us < settings_.start_us) return -1;
  // Unsigned, since the time from the start to the latest time there is may be more than a signed number holds.
  const std::uint64_t since = static_cast<std::uint64_t>(t_us) - static_cast<std::uint64_t>(settings_.start_us);
  const std::uint64_t window = since / static_cast<std::uint64_t>(settings_.length_us);
  if (window > static_cast<std::uint64_t>(kMostWindows)) return kMostWindows + 1;
  return static_cast<std::int64_t>(window);
}

void EventWindows::finish_before(std::int64_t window) {
  while (static_cast<std::int64_t>(finished_.size()) < window) {
    finished_.push_back(open_);
    open_ = {};
  }
}

void EventWindows::add(std::span<const Event> events) {
  for (const Event& event : events) {
    if (event.t_us < last_us_) {
      fail("event {}: its time is {} us, that of the one before is {} us; times must not go backwards", events_,
           event.t_us, last_us_);
    }
    if (event.x >= settings_.size.width || event.y >= settings_.size.height) {
      fail("event {}: its pixel is ({}, {}), the camera has {} x {}", events_, event.x, event.y, settings_.size.width,
           settings_.size.height);
    }
    const std::int64_t window = window_at(event.t_us);
    if (window > kMostWindows) {
      fail("event {}: its time is {} us: from {} us on, in steps of {} us, only {} windows are counted", events_,
           event.t_us, settings_.start_us, settings_.length_us, kMostWindows);
    }
    last_us_ = event.t_us;
    ++events_;
    if (window < 0) {
      ++before_start_;
      continue;
    }
    finish_before(window);
    if (!settings_.region.contains({event.x, event.y})) {
      ++beside_region_;
      continue;
    }
    ++(event.on ? open_.on : open_.off);
  }
}

void EventWindows::end_at(std::int64_t t_us) {
  const std::int64_t window = window_at(t_us);
  if (window > kMostWindows) {
    fail("event windows: they can't end at {} us: that would be more than {}", t_us, kMostWindows);
  }
  finish_before(window);
  if (t_us > last_us_) last_us_ = t_us;
}

std::vector<EventCounts> count_windows(std::span<const Event> events, const EventWindowSettings& settings,
                                       std::int64_t end_us) {
  EventWindows windows(settings);
  windows.add(events);
  if (!events.empty() && events.back().t_us >= end_us) {
    fail("event {}: its time is {} us, the recording ends at {} us", events.size() - 1, events.back().t_us, end_us);
  }
  windows.end_at(end_us);
  return {windows.finished().begin(), windows.finished().end()};
}

}  // namespace touchstone::sensors
