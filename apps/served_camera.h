#pragma once
// The frames of a camera that runs by the clock: which is due, what it shows, its JPEG. Made when somebody asks.

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "apps/jpeg_answers.h"
#include "lab/device/camera_state.h"

namespace touchstone::apps {

/// One frame as it is delivered. Its noise is that of its number: no two frames have the same.
struct ServedFrame : NumberedJpeg {
  std::shared_ptr<const lab::CameraState> state;
};

/// Safe to use from many threads.
class ServedCamera {
 public:
  using States = std::vector<std::shared_ptr<const lab::CameraState>>;

  /// Shows `states` one a frame, again and again. @pre not empty, rate above 0
  ServedCamera(States states, double rate_Hz, int jpeg_quality);

  /// The frame that is due now, and when asked for one after `after` the first that is due later.
  /// Null once the camera was stopped.
  std::shared_ptr<const ServedFrame> latest();
  std::shared_ptr<const ServedFrame> next(std::int64_t after);
  /// What the frame of this number shows; nothing for one that isn't due yet or was too long ago.
  std::shared_ptr<const lab::CameraState> state_of(std::int64_t number) const;

  /// From the next frame on other states, from their first one.
  void show(States states);
  /// From the next frame on only that state of those that are shown; nothing: all of them, from the first one.
  /// @throws Error if there is no such state
  void hold(std::optional<int> state);
  int state_count() const;
  double rate_Hz() const { return rate_Hz_; }
  void stop();

 private:
  /// What is shown from a frame on.
  struct Change {
    std::int64_t from = 0;
    std::shared_ptr<const States> states;
    std::optional<int> held;
  };

  std::int64_t due() const;
  std::chrono::steady_clock::time_point time_of(std::int64_t number) const;
  std::shared_ptr<const lab::CameraState> state_at(std::int64_t number) const;
  void change(std::shared_ptr<const States> states, std::optional<int> held);
  std::shared_ptr<const ServedFrame> frame(std::int64_t number);

  const double rate_Hz_;
  const int quality_;
  const std::chrono::steady_clock::time_point start_;
  mutable std::mutex mutex_;
  std::condition_variable stopping_;
  bool stopped_ = false;
  std::vector<Change> changes_;
  std::mutex making_;  // one thread makes a frame, the others wait for it
  std::shared_ptr<const ServedFrame> made_;
};

}  // namespace touchstone::apps
