#pragma once

#include <opencv2/core/mat.hpp>

namespace touchstone::sensors {

/// How large a dark marker on white looks: what the hue is held against [Lin2019, sec. III.D, fig. 6].
struct MarkerSize {
  int pixels = 0;  ///< darker than the threshold: a picture of 1 bit, as the paper has it
  double darkness_px =
      0.0;  ///< sum of 1 - luminosity over all pixels: rims count by their greys, and so does the light
};

/// @param grey CV_8UC1 or CV_32FC1, one marker on white; full scale is 255 or 1
/// @param threshold part of the full scale, above 0 and below 1
/// @throws Error for another kind of picture or threshold
MarkerSize marker_size(const cv::Mat& grey, double threshold = 0.5);

}  // namespace touchstone::sensors
