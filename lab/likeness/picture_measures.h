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

/// How a frame's colours go with those of rest where nothing touches.
struct FrameGain {
  cv::Vec3d gain{1, 1, 1};  ///< frame over rest, B, G, R: a camera's automatic exposure and white balance
  double alike = 0.0;       ///< share of these pixels within 5 % of it, mean over channels
};
/// The mode, a channel, of log(frame / rest), both as means over 7 x 7 pixels and from 8 to 250: of a histogram with
/// bins of 0.002 from -0.6 to 0.6, smoothed by a Gaussian of 0.01. Gain 1 where no pixel counts.
/// @pre frame CV_8UC3, rest CV_32FC3, of one size
FrameGain gain_of(const cv::Mat& frame, const cv::Mat& rest);

/// The frame divided by the gain: CV_32FC3.
cv::Mat balanced(const cv::Mat& frame, const FrameGain& gain);

}  // namespace touchstone::lab
