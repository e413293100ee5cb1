#pragma once
// A motion chip's picture, as it is got out of the chip: one pixel a frame, so its pixels are of different times.
//
// The ADNS-2620's register Pixel_Data gives pixel 1 of the next frame after a write, and the next pixel of the next
// frame with each read after that [ADNS2620]: 324 frames a picture, 4.6 pictures a second at 1500 Hz. Pixels are
// numbered from the lower left, up, column by column, to the upper right: the map of the register-compatible ADNS-5050
// [ADNS5050], and what users of the 2610 and 2620 report.

#include <cstdint>
#include <opencv2/core/mat.hpp>

namespace touchstone {

/// Pixels along a side of the chip's square picture.
inline constexpr int kChipSide = 18;
/// Pixels of a picture, and so frames that it takes to read one.
inline constexpr int kChipPixels = kChipSide * kChipSide;

/// Where a pixel lies in the picture as a person sees it.
struct ChipPlace {
  int row = 0;     ///< from the top of the picture
  int column = 0;  ///< from the left
};

/// The pixel that the n-th frame of a picture gives, n from 0 to 323.
constexpr ChipPlace grabbed_place(int n) {
  return {kChipSide - 1 - n % kChipSide, n / kChipSide};
}

/// One picture read out of the chip, with the time that it took.
struct GrabbedImage {
  cv::Mat image;              ///< CV_8UC1, 18x18, 0 to 63
  std::int64_t first_us = 0;  ///< end of the exposure of the first pixel grabbed
  std::int64_t last_us = 0;   ///< of the last one; those between are evenly spaced
};

}  // namespace touchstone
