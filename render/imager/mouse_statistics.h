#pragma once
// What the optical mouse sensor ADNS-2620 reports of each frame without handing the frame over.

#include <opencv2/core/mat.hpp>

namespace touchstone::render {

/// The registers after the data sheet [ADNS2620], but for `squal`: the chip's way to count features isn't public, and
/// ours is described at `trackable_features`.
struct MouseStatistics {
  int pixel_sum = 0;     ///< Pixel_Sum: the sum of the 324 pixels / 128, rounded down; 0 to 159
  int maximum = 0;       ///< Maximum_Pixel, 0 to 63
  int minimum = 0;       ///< Minimum_Pixel, 0 to 63
  int shutter = 0;       ///< Shutter: the exposure in ticks of the 24 MHz clock, 0 to 65535
  int squal = 0;         ///< trackable features, 0 to 196
  double average = 0.0;  ///< of the pixels, as a host gets it from Pixel_Sum: pixel_sum * 128 / 324
};

/// @throws Error if `raw` isn't 18x18 of type CV_8UC1 with numbers up to 63, or the exposure doesn't fit the register
MouseStatistics mouse_statistics(const cv::Mat& raw, double exposure_s);

/// How many places of a CV_8UC1 picture can be distinguished from their neighbours in both directions: windows of 3x3
/// pixels, of all that have their central differences inside the picture, whose mean gradient tensor has a smaller
/// eigenvalue of at least 1 DN^2 per pixel^2 (the criterion of [Shi1994] with a threshold of one step a pixel). 14x14
/// windows at most for 18x18 pixels. A flat picture, a ramp and a straight edge have none.
int trackable_features(const cv::Mat& raw);

}  // namespace touchstone::render
