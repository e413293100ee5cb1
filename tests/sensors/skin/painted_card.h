#pragma once
// Pictures through a gel of known colours, under light that falls to the rim and is warm.

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace touchstone::sensors::fixtures {

/// `albedo(place)` (R, G, B) everywhere but for a bead in the middle of 160 x 120 pixels.
template <typename Albedo>
cv::Mat seen_card(const Albedo& albedo) {
  cv::Mat picture(120, 160, CV_8UC3);
  for (int row = 0; row < picture.rows; ++row) {
    for (int column = 0; column < picture.cols; ++column) {
      const double light = 220.0 - 0.6 * std::hypot(column - 80, row - 60);
      const Eigen::Vector3d lamp(1.0, 0.9, 0.7);
      const Eigen::Vector3d share = albedo(cv::Point(column, row));
      for (int k = 0; k < 3; ++k) {
        picture.at<cv::Vec3b>(row, column)[2 - k] = cv::saturate_cast<std::uint8_t>(light * lamp[k] * share[k]);
      }
    }
  }
  cv::circle(picture, {80, 60}, 6, cv::Scalar::all(5), cv::FILLED);
  return picture;
}

/// The same of one colour.
inline cv::Mat seen(const Eigen::Vector3d& albedo) {
  return seen_card([&](const cv::Point&) { return albedo; });
}

}  // namespace touchstone::sensors::fixtures
