#include "sensors/events/event_check.h"

#include "core/error.h"

namespace touchstone::sensors {

void EventCheck::pass(std::span<const Event> events) {
  for (const Event& event : events) {
    if (!takes(event)) refuse(event, fmt::format("event {}", seen_));
    take(event);
  }
}

void EventCheck::refuse(const Event& event, const std::string& where) const {
  if (event.x >= size_.width || event.y >= size_.height) {
    fail("{}: {} is at column {}, row {}; allowed are columns 0 to {} and rows 0 to {}", file_, where, event.x, event.y,
         size_.width - 1, size_.height - 1);
  }
  fail("{}: {} is at {} us, before the {} us of the event that comes before it; time may not go backwards", file_,
       where, event.t_us, last_us_);
}

}  // namespace touchstone::sensors
