#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

namespace touchstone::sensors {

inline constexpr int kMostPyramidLevels = 8;  ///< each has half the side of the one before

/// The image and its reductions by half: level i + 1 is level i, weighted by the kernel of [Burt1983] with
/// a = 0.375, that is (1, 4, 6, 4, 1) / 16 along each axis, at every second pixel. A side of n px becomes (n + 1) / 2;
/// beyond its border an image is mirrored in its outermost pixels; brightness is rounded to 8 bit on each level.
/// @param gray CV_8UC1, level 0 of the answer shares its pixels
/// @param levels 1 to 8
/// @throws Error for another kind of image, or if a level would have to be made from fewer than 3 px a side
std::vector<cv::Mat> gaussian_pyramid(const cv::Mat& gray, int levels);

}  // namespace touchstone::sensors
