#pragma once
// Frames of skin with two marks, seen through a gel with beads.

#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace touchstone::sensors::fixtures {

inline constexpr int kSkinWidth = 320;
inline constexpr int kSkinHeight = 240;
inline const cv::Scalar kEvenSkin(60, 75, 120);   // B G R
inline const cv::Scalar kRedMark(50, 52, 128);    // 14 units more than the skin
inline const cv::Scalar kPurpleMark(35, 28, 66);  // 17 units more
inline const cv::Point kLeftMark(90, 120), kRightMark(230, 120);

/// Unevenly lit, with noise and beads.
inline cv::Mat skin_frame(const cv::Scalar& left, const cv::Scalar& right, double brightness, int seed) {
  cv::Mat picture(kSkinHeight, kSkinWidth, CV_32FC3, kEvenSkin);
  cv::circle(picture, kLeftMark, 35, left, cv::FILLED);
  cv::circle(picture, kRightMark, 35, right, cv::FILLED);
  for (int k = 0; k < 3; ++k) cv::circle(picture, {160, 60 + 60 * k}, 8, cv::Scalar(5, 5, 5), cv::FILLED);
  for (int row = 0; row < kSkinHeight; ++row) {
    for (int column = 0; column < kSkinWidth; ++column) {
      const double fall = 1.0 - 0.4 * cv::norm(cv::Point(column, row) - cv::Point(160, 120)) / 200.0;
      picture.at<cv::Vec3f>(row, column) *= static_cast<float>(brightness * fall);
    }
  }
  cv::GaussianBlur(picture, picture, {}, 3.0);
  cv::Mat noise(picture.size(), CV_32FC3);
  cv::RNG random(static_cast<std::uint64_t>(seed));
  random.fill(noise, cv::RNG::NORMAL, 0.0, 4.0);
  picture += noise;
  cv::Mat bytes;
  picture.convertTo(bytes, CV_8U);
  return bytes;
}

}  // namespace touchstone::sensors::fixtures
