#pragma once
// A ball of known size pressed into the gel: where it touches, the membrane's slopes are the ball's.

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "sensors/heights/background.h"
#include "sensors/heights/lamp_model.h"

namespace touchstone::sensors {

/// The outline of the touched part of a ball in a picture.
struct ContactCircle {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();  ///< px, see height_map.h
  double radius = 0.0;                               ///< px; smaller than the ball's own, which isn't pressed in whole
};

/// One calibration frame.
struct BallPress {
  std::string name;  ///< of the frame, for messages
  cv::Mat frame;     ///< CV_8UC3, BGR
  ContactCircle circle;
  double ball_radius_mm = 0.0;
};

/// The slope of a ball's imprint at `offset_mm` from its centre: -offset / sqrt(R^2 - r^2).
/// @pre the offset is shorter than the radius
Eigen::Vector2d ball_slope(const Eigen::Vector2d& offset_mm, double ball_radius_mm);

/// Which pixels of a press are samples.
struct PressSampling {
  double rim_px = 1.0;          ///< pixels nearer to the circle's rim are left out: half of their light is from outside
  double most_saturated = 0.2;  ///< share of the circle's pixels that may be saturated; they are left out
};

/// The pixels of the touched part, colours as frame - background, not corrected for the place.
/// @throws Error naming the press: an unfit frame; a circle that isn't finite, reaches over the picture's edge, is as
///   large as the ball or smaller than 4 px; nothing pressed in it; a second contact beside it; too much saturation
std::vector<ColourSample> samples_of(const BallPress& press, const Background& background, double mm_per_px,
                                     const PressSampling& how = {});

/// Looks for the one ball that a frame shows: the region that is brighter than the background, its outline's circle;
/// the centre is then moved to where matt shading of the ball explains the colours best, and the radius put where
/// circles are brightest, just inside of the rim of contact (it comes out 1 to 2 px small, which costs pixels only).
/// @throws Error naming `name` if there's nothing, more than one contact, or a contact that touches the picture's edge
ContactCircle find_contact_circle(const cv::Mat& frame, const Background& background, double ball_radius_mm,
                                  double mm_per_px, const std::string& name);

}  // namespace touchstone::sensors
