#pragma once
// What overlays are drawn with.

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <string>

namespace touchstone::sensors {

/// Fractional bits of the coordinates that drawn_at() gives, for OpenCV's `shift`.
inline constexpr int kDrawingShift = 4;

/// A position (px, pixel centres at + 0.5) for OpenCV's drawing, whose pixel centres are whole numbers. One far outside
/// is drawn at the limit of its numbers.
cv::Point drawn_at(const Eigen::Vector2d& position);

/// Makes `picture` a BGR copy of a frame; the two may be one. @pre the frame is CV_8UC1 or CV_8UC3
void copy_in_colour(const cv::Mat& frame, cv::Mat& picture);

/// Writes into the picture's lower left corner, with a black rim, so that it can be read on any ground. @pre CV_8UC3
void write_below(const std::string& words, const cv::Scalar& colour, cv::Mat& picture);

}  // namespace touchstone::sensors
