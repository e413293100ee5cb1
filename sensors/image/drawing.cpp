#include "sensors/image/drawing.h"

#include <cmath>
#include <opencv2/imgproc.hpp>

namespace touchstone::sensors {

cv::Point drawn_at(const Eigen::Vector2d& position) {
  constexpr double kFar = 20000.0;
  const Eigen::Vector2d at = (position.array() - 0.5).max(-kFar).min(kFar);
  return {static_cast<int>(std::lround(at.x() * (1 << kDrawingShift))),
          static_cast<int>(std::lround(at.y() * (1 << kDrawingShift)))};
}

void copy_in_colour(const cv::Mat& frame, cv::Mat& picture) {
  if (frame.channels() == 1) {
    cv::cvtColor(frame, picture, cv::COLOR_GRAY2BGR);
  } else if (frame.data != picture.data) {
    frame.copyTo(picture);
  }
}

void write_below(const std::string& words, const cv::Scalar& colour, cv::Mat& picture) {
  const cv::Point at(4, picture.rows - 6);
  cv::putText(picture, words, at, cv::FONT_HERSHEY_SIMPLEX, 0.4, cv::Scalar(0, 0, 0), 3, cv::LINE_AA);
  cv::putText(picture, words, at, cv::FONT_HERSHEY_SIMPLEX, 0.4, colour, 1, cv::LINE_AA);
}

}  // namespace touchstone::sensors
