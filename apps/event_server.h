#pragma once
// An event camera on a TCP socket: to each client that connects, EVT 3.0 as an .raw file has it, header first, from
// that moment on and as the events happen.

#include <cstdint>
#include <memory>
#include <opencv2/core/types.hpp>
#include <string>
#include <vector>

#include "core/frame.h"

namespace touchstone::apps {

/// What happens again and again.
struct EventLoop {
  std::vector<Event> events;   ///< in the order of time, 0 <= t < period_us
  std::int64_t period_us = 0;  ///< above 0
  double speed = 1.0;          ///< microseconds of the events' time that pass in a real one
  cv::Size size;               ///< of the camera, px
};

/// Each client has a thread that sends what has happened since it last sent. One that is more than 2 s behind goes on
/// from now: its stream's time jumps by more than that, where otherwise a time comes every few milliseconds. One that
/// takes nothing for the patience is ended, after a second already if its place is wanted; when all 64 places are of
/// clients that read, a further one gets a header whose line "error" says so.
class EventServer {
 public:
  /// @param port 0: any free one @throws Error if it can't be had, or EVT 3.0 can't hold such a camera
  EventServer(EventLoop loop, const std::string& address, int port, double patience_s);
  /// Ends all connections.
  ~EventServer();
  EventServer(const EventServer&) = delete;
  EventServer& operator=(const EventServer&) = delete;

  int port() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace touchstone::apps
