#pragma once
// What the tests of the event pixels share.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <opencv2/core.hpp>
#include <string>
#include <tuple>
#include <vector>

#include "core/error.h"
#include "core/frame.h"
#include "render/events/event_pixels.h"

namespace touchstone::render {

// Pixels without noise or lag, all alike, that hardly see the dark's current.
inline EventPixelSettings ideal(double on = 0.2, double off = 0.2) {
  EventPixelSettings settings;
  settings.on_threshold = on;
  settings.off_threshold = off;
  settings.dark_intensity = 1e-9;
  return settings;
}

inline cv::Mat flat(double intensity, int width = 1, int height = 1) {
  return cv::Mat(height, width, CV_32FC1, cv::Scalar(intensity));
}

// The events of one picture after the other; light(t) is the same for all pixels.
inline std::vector<Event> watch(EventPixels& pixels, const std::function<double(double)>& light, std::int64_t begin_us,
                                std::int64_t end_us, std::int64_t step_us) {
  std::vector<Event> events;
  for (std::int64_t t = begin_us; t <= end_us; t += step_us) {
    pixels.advance(flat(light(static_cast<double>(t)), pixels.size().width, pixels.size().height), t, events);
  }
  return events;
}

inline std::string message_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  }
  ADD_FAILURE() << "nothing was refused";
  return {};
}

inline auto order_of(const Event& event) {
  return std::tuple(event.t_us, event.y, event.x, event.on);
}

inline bool in_order(const std::vector<Event>& events) {
  return std::is_sorted(events.begin(), events.end(),
                        [](const Event& a, const Event& b) { return order_of(a) < order_of(b); });
}

}  // namespace touchstone::render
