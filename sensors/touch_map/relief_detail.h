#pragma once
// The fine relief in a touch's heights, freed of what depends on how the touch was made: depth, tilt, the gel's sag.

#include <opencv2/core/mat.hpp>

#include "sensors/touch_map/touch_image.h"

namespace touchstone::sensors {

/// Which lengths are noise, detail and shape.
struct DetailSettings {
  double noise_mm = 0.04;  ///< sigma of the Gaussian that takes noise away
  /// Sigma of the Gaussian whose mean is taken for shape. Beside steep edges estimated heights bulge over a millimetre
  /// or so, and the bulges stay with the sensor: the wider this is, the more they outweigh a plug's windows and seam
  /// (of a touch's features 15 agreed with the map's with 0.4 mm, 25 with 0.25 mm).
  double shape_mm = 0.25;
  double gap_mm =
      1.3;  ///< gaps in the contact up to twice this wide are taken for part of the object: windows, grooves
  double margin_mm = 0.6;  ///< round the contact that belongs to it: there the object's outline shows
  double fade_mm = 0.1;    ///< over which detail fades in from the support's border, so that it makes no corners
};

/// The detail of one touch.
struct ReliefDetail {
  cv::Mat detail_mm;    ///< CV_32FC1: heights less their mean over the neighbourhood; 0 outside the support and fading
                        ///< towards its border
  cv::Mat weight;       ///< CV_32FC1, 0 to 1: the share of the neighbourhood that was touched; 0 outside the support
  double rms_mm = 0.0;  ///< weighted, over the support; 0 without contact
  PixelFrame frame;
};

/// Contact with its gaps closed and a margin round it, CV_8UC1.
cv::Mat support_of(const TouchImage& touch, const DetailSettings& settings);

/// Detail over its own root mean square in the neighbourhood of `sigma_mm`, which counts as at least `least_rms_mm`:
/// faint lines show beside deep steps. CV_32FC1, pure numbers.
cv::Mat evened(const ReliefDetail& detail, double sigma_mm, double least_rms_mm);

/// Differences of Gaussians with the means over `support` (CV_8UC1) alone (normalised convolution [Knutsson1993]), so
/// that the untouched surroundings don't leak in.
ReliefDetail relief_detail(const cv::Mat& height_mm, const cv::Mat& support, const PixelFrame& frame,
                           const DetailSettings& settings);

/// The same for a touch, in its own frame, over its support. @throws Error as `check(touch)` does
ReliefDetail relief_detail(const TouchImage& touch, const DetailSettings& settings);

}  // namespace touchstone::sensors
