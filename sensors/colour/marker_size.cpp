#include "sensors/colour/marker_size.h"

#include "core/error.h"

namespace touchstone::sensors {

MarkerSize marker_size(const cv::Mat& grey, double threshold) {
  if (grey.empty() || (grey.type() != CV_8UC1 && grey.type() != CV_32FC1)) {
    fail("marker size: the picture has {} channels of depth {}, one of 8 bit or float is needed", grey.channels(),
         grey.depth());
  }
  if (!(threshold > 0.0 && threshold < 1.0)) {
    fail("marker size: the threshold is {}, it must be above 0 and below 1", threshold);
  }
  MarkerSize size;
  for (int y = 0; y < grey.rows; ++y) {
    for (int x = 0; x < grey.cols; ++x) {
      const double value =
          grey.type() == CV_8UC1 ? grey.at<std::uint8_t>(y, x) / 255.0 : static_cast<double>(grey.at<float>(y, x));
      if (value < threshold) ++size.pixels;
      size.darkness_px += 1.0 - value;
    }
  }
  return size;
}

}  // namespace touchstone::sensors
