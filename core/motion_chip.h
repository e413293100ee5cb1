#pragma once
// What a motion-sensing chip (that of an optical mouse) reports of each frame.

#include <cstdint>

namespace touchstone {

/// Statistics of one frame, pixels being 0 to 63.
struct ChipStatistics {
  std::int64_t t_us = 0;  ///< end of the frame's exposure
  int dx = 0, dy = 0;     ///< motion since the frame before, the chip's own counts, -128 to 127
  int maximum = 0;        ///< of the pixels, 0 to 63
  int minimum = 0;        ///< of the pixels, 0 to 63
  int squal = 0;          ///< surface quality: how many features are seen, 0 to 255
  double average = 0.0;   ///< of the pixels, 0 to 63
};

}  // namespace touchstone
