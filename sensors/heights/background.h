#pragma once
// The picture of the untouched gel, which every frame is held against [Li2015, sec. 2.2.2, step 1].

#include <limits>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <span>
#include <string>

namespace touchstone::sensors {

/// Mean of one or more frames without contact.
struct Background {
  cv::Mat mean;                       ///< CV_32FC3, BGR, digital numbers
  int frames = 0;                     ///< how many it is the mean of
  std::optional<cv::Vec3d> noise_DN;  ///< standard deviation of one frame, a channel each; from two frames on
};

/// What makes a picture unfit as a frame of a colour sensor, or the empty string: it must have three channels of 8 bit
/// and, if `size` isn't empty, that size.
std::string frame_fault(const cv::Mat& frame, const cv::Size& size);

/// @throws Error if there is no frame, if one is unfit or differs in size from the first, or if more than 1 % of a
/// frame's pixels are saturated (a difference to 255 shows nothing)
Background mean_background(std::span<const cv::Mat> frames);

/// frame / gain - background with its sign, CV_32FC3. `gain` is what the frame's channels are stronger by
/// (frame_gain.h). What is above `ceiling_DN` of the background's numbers counts as the ceiling, in both.
/// @throws Error naming what makes the frame unfit
cv::Mat difference_to(const Background& background, const cv::Mat& frame, const cv::Vec3d& gain = {1.0, 1.0, 1.0},
                      double ceiling_DN = std::numeric_limits<double>::infinity());

/// The share of pixels with a channel at 255.
double saturated_share(const cv::Mat& frame);

/// How many of a pixel's channels are cut off at 255. One leaves two that still show a slope; two leave none.
inline int saturated_channels(const cv::Vec3b& pixel) {
  return (pixel[0] == 255 ? 1 : 0) + (pixel[1] == 255 ? 1 : 0) + (pixel[2] == 255 ? 1 : 0);
}

}  // namespace touchstone::sensors
