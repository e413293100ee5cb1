#include "sim/sensor/event_picture.h"

#include <algorithm>
#include <cstdlib>

#include "core/error.h"

namespace touchstone::sim {

cv::Mat event_picture(std::span<const Event> events, cv::Size size) {
  constexpr int kFull = 4;  // events
  cv::Mat on(size, CV_32S, cv::Scalar(0));
  cv::Mat off(size, CV_32S, cv::Scalar(0));
  for (const Event& event : events) {
    TS_ASSERT(event.x < size.width && event.y < size.height);
    ++(event.on ? on : off).at<int>(event.y, event.x);
  }
  cv::Mat picture(size, CV_8UC3);
  for (int row = 0; row < size.height; ++row) {
    for (int column = 0; column < size.width; ++column) {
      const int more = on.at<int>(row, column) - off.at<int>(row, column);
      const bool both = more == 0 && on.at<int>(row, column) > 0;
      const auto pale = static_cast<unsigned char>(both ? 128 : 255 - 255 * std::min(kFull, std::abs(more)) / kFull);
      const unsigned char full = both ? 128 : 255;
      auto& pixel = picture.at<cv::Vec3b>(row, column);
      pixel = more >= 0 ? cv::Vec3b(pale, pale, full) : cv::Vec3b(full, pale, pale);
    }
  }
  return picture;
}

}  // namespace touchstone::sim
