#include "render/imager/mouse_statistics.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <vector>

#include "core/error.h"

namespace touchstone::render {

int trackable_features(const cv::Mat& raw) {
  if (raw.type() != CV_8UC1)
    fail("features are counted in a grey picture of 8 bit numbers; this has type {}", raw.type());
  constexpr double kLeastEigenvalue = 1.0;    // DN^2 per pixel^2
  constexpr double kTensorPart = 1.0 / 36.0;  // of products of differences over two pixels, summed over nine
  const int rows = raw.rows - 2;              // where central differences can be had
  const int columns = raw.cols - 2;
  if (rows < 3 || columns < 3) return 0;
  struct Products {
    int xx, xy, yy;
  };
  std::vector<Products> products(static_cast<std::size_t>(rows) * columns);
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const unsigned char* here = raw.ptr<unsigned char>(row + 1) + column;
      const int dx = here[2] - here[0];
      const int dy = raw.at<unsigned char>(row + 2, column + 1) - raw.at<unsigned char>(row, column + 1);
      products[static_cast<std::size_t>(row) * columns + column] = {dx * dx, dx * dy, dy * dy};
    }
  }
  int features = 0;
  for (int row = 1; row + 1 < rows; ++row) {
    for (int column = 1; column + 1 < columns; ++column) {
      Products sum{0, 0, 0};
      for (int y = row - 1; y <= row + 1; ++y) {
        const Products* of_row = products.data() + static_cast<std::size_t>(y) * columns + column;
        for (int x = -1; x <= 1; ++x) {
          sum = {sum.xx + of_row[x].xx, sum.xy + of_row[x].xy, sum.yy + of_row[x].yy};
        }
      }
      const double bend = std::hypot(0.5 * (sum.xx - sum.yy), sum.xy);
      if (kTensorPart * (0.5 * (sum.xx + sum.yy) - bend) >= kLeastEigenvalue) ++features;
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
