#pragma once
// What a height map is, for all estimators of a coated gel:
//
// - Pixel coordinates u (right) and v (down); the first pixel's centre is at (0.5, 0.5).
// - A height is how far the membrane is pressed into the sensor, mm, CV_32FC1: 0 where it is at rest, positive under an
//   object ("the larger the force, the larger the height map", [Li2015, sec. 4.2]), slightly negative where the gel
//   bulges.
// - Slopes are the height's derivatives along u and v, mm/mm, CV_32FC1. The membrane's normal towards the camera is
//   (-slope_u, -slope_v, 1) / sqrt(1 + slope_u^2 + slope_v^2); the thesis's G = (Nx/Nz, Ny/Nz) is that up to the sign.
// - One scale, mm_per_px, for the whole picture: the membrane's height changes it by height/distance, which is left out
//   (1 mm before a camera 30 mm away: 3 %).

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

namespace touchstone::sensors {

/// The unit normal towards the camera of a membrane with these slopes.
Eigen::Vector3d normal_of(const Eigen::Vector2d& slope);

/// What counts as contact: higher than both the floor and a share of the map's highest point. Geometry alone can't show
/// where an object's edge lets go of the gel; under a ball the membrane stands at half of the depth there on a thick
/// gel (Hertz) and lower on a thin one.
struct ContactRule {
  double floor_mm = 0.02;  ///< several times the noise of a height map
  double share = 0.35;     ///< 0 to 1
};

/// Writes 255 where there is contact and 0 elsewhere (CV_8UC1, allocated if it doesn't fit). Returns the pixels in
/// contact. @pre heights is CV_32FC1
int mark_contact(const cv::Mat& heights_mm, const ContactRule& rule, cv::Mat& mask);

/// Whether a mask's outermost pixels hold one that isn't 0. @pre mask is CV_8UC1
bool touches_border(const cv::Mat& mask);

/// Shifts a map so that the mean over its outermost pixels is 0: for heights that are known up to a constant.
/// @pre heights is CV_32FC1
void level_by_border(cv::Mat& heights_mm);

}  // namespace touchstone::sensors
