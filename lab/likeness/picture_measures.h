#pragma once
// How far two difference pictures (a frame less the untouched sensor's) are from each other.

#include <opencv2/core/mat.hpp>

#include "sensors/heights/ball_press.h"

namespace touchstone::lab {

/// 10 log10(255^2 / mean square difference) over all pixels and channels, dB; infinite for equal pictures.
/// @pre both CV_32FC3 of one size
double psnr(const cv::Mat& a, const cv::Mat& b);

/// Structural similarity [Wang2004, eq. 13] of 128 + a and 128 + b, not clipped: means, variances and covariance (over
/// 48) in windows of 7 x 7 pixels of equal weight, C1 = (0.01 x 255)^2, C2 = (0.03 x 255)^2; the mean over all windows
/// that lie whole in the picture, and over channels. @pre both CV_32FC3 of one size, 7 pixels a side or more
double ssim(const cv::Mat& a, const cv::Mat& b);

/// Mean absolute differences over pixels and channels, in numbers of 255.
struct RegionDifference {
  double inside = 0.0;  ///< the circle
  double ring = 0.0;    ///< the ring about it, one of its radii wide; 0 where the picture has none of it
};
/// @pre both CV_32FC3 of one size; the circle's centre lies in the picture
RegionDifference region_difference(const cv::Mat& a, const cv::Mat& b, const sensors::ContactCircle& circle);

}  // namespace touchstone::lab
