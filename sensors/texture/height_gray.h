#pragma once

#include <opencv2/core/mat.hpp>

namespace touchstone::sensors {

/// A height image as a gray one: the brighter, the higher [Li2015, sec. 5.3.2]. A level of brightness is `step_mm`
/// high, and the image's median is level 128; what is more than 127 levels away is cut off.
///
/// The step is a length and not a share of the image's own range, so that one scratch doesn't change all levels. Local
/// binary patterns don't mind the scale, but on flat parts they see the noise: a step above the noise makes these
/// parts truly flat.
/// @param heights_mm CV_32FC1
/// @throws Error for an empty image, another kind, a height that isn't finite, or a step that isn't above 0
cv::Mat height_gray(const cv::Mat& heights_mm, double step_mm);

}  // namespace touchstone::sensors
