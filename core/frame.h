#pragma once
// What a camera or an event camera delivers. Estimators read these and never learn where they came from.

#include <cstdint>
#include <opencv2/core/mat.hpp>

namespace touchstone {

/// One picture. `image` is 8 or 16 bit, one channel (grey) or three (BGR, OpenCV's order).
struct Frame {
  cv::Mat image;
  std::int64_t t_us = 0;  ///< start of the exposure
};

/// One brightness change seen by one pixel of an event camera.
struct Event {
  std::int64_t t_us = 0;
  std::uint16_t x = 0;
  std::uint16_t y = 0;
  bool on = false;  ///< true where the light grew
};

}  // namespace touchstone
