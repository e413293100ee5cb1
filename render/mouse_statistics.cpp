#include "render/mouse_statistics.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "core/error.h"

namespace touchstone::render {

int trackable_features(const cv::Mat& raw) {
  if (raw.type() != CV_8UC1)
    fail("features are counted in a grey picture of 8 bit numbers; this has type {}", raw.type());
  constexpr double kLeastEigenvalue = 1.0;  // DN^2 per pixel^2
  int features = 0;
  for (int row = 2; row < raw.rows - 2; ++row) {
    for (int column = 2; column < raw.cols - 2; ++column) {
      double xx = 0.0;
      double xy = 0.0;
      double yy = 0.0;
      for (int y = row - 1; y <= row + 1; ++y) {
        for (int x = column - 1; x <= column + 1; ++x) {
          const double dx = 0.5 * (raw.at<unsigned char>(y, x + 1) - raw.at<unsigned char>(y, x - 1));
          const double dy = 0.5 * (raw.at<unsigned char>(y + 1, x) - raw.at<unsigned char>(y - 1, x));
          xx += dx * dx / 9.0;
          xy += dx * dy / 9.0;
          yy += dy * dy / 9.0;
        }
      }
      const double smaller = 0.5 * (xx + yy) - std::hypot(0.5 * (xx - yy), xy);
      if (smaller >= kLeastEigenvalue) ++features;
    }
  }
  return features;
}

MouseStatistics mouse_statistics(const cv::Mat& raw, double exposure_s) {
  constexpr int kSide = 18;
  constexpr int kLargest = 63;
  constexpr int kSumStep = 128;
  constexpr double kClock_Hz = 24e6;
  constexpr double kMostTicks = 65535.0;
  if (raw.rows != kSide || raw.cols != kSide || raw.type() != CV_8UC1) {
    fail("mouse statistics: the picture is {}x{} of OpenCV type {}; it must be 18x18 of type {} (CV_8UC1)", raw.cols,
         raw.rows, raw.type(), CV_8UC1);
  }
  const double ticks = std::round(exposure_s * kClock_Hz);
  if (!(ticks >= 0.0 && ticks <= kMostTicks)) {
    fail("mouse statistics: an exposure of {} s; the shutter's register holds 0 to {} s", exposure_s,
         kMostTicks / kClock_Hz);
  }
  MouseStatistics statistics;
  double minimum = 0.0;
  double maximum = 0.0;
  cv::minMaxLoc(raw, &minimum, &maximum);
  if (maximum > kLargest) fail("mouse statistics: a pixel is {}; 6 bits hold 0 to 63", maximum);
  statistics.minimum = static_cast<int>(minimum);
  statistics.maximum = static_cast<int>(maximum);
  statistics.pixel_sum = static_cast<int>(cv::sum(raw)[0]) / kSumStep;
  statistics.average = static_cast<double>(statistics.pixel_sum) * kSumStep / (kSide * kSide);
  statistics.shutter = static_cast<int>(ticks);
  statistics.squal = trackable_features(raw);
  return statistics;
}

}  // namespace touchstone::render
