#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <span>

namespace touchstone::sensors {

/// Paints the membrane over markers: within `radius_px` of each of `places` a picture gets the plane that fits the ring
/// outside (up to twice the radius) best, in each channel, so that a height estimator sees a gel without markers. To be
/// done to the background and to each frame, with where the markers are in it. What is finer than a marker is lost
/// there. A place with too little ring within the picture, or next to nothing but other markers, gets the ring's mean,
/// or stays as it is.
/// @throws Error unless the picture is 8 bit and BGR, and the radius is at least 1
void fill_markers(cv::Mat& picture, std::span<const Eigen::Vector2d> places, double radius_px);

/// For markers of a diameter: their ink, rim and blur are within it. At least 1.
double fill_radius_px(double diameter_px);

}  // namespace touchstone::sensors
