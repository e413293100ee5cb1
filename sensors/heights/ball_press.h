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
  std::string name;                     ///< of the frame, for messages
  cv::Mat frame;                        ///< CV_8UC3, BGR
  std::optional<ContactCircle> circle;  ///< absent: to be found
  double ball_radius_mm = 0.0;
};

/// The slope of a ball's imprint at `offset_mm` from its centre, where it touches: -offset / sqrt(R^2 - r^2).
/// @pre the offset is shorter than the radius
Eigen::Vector2d ball_slope(const Eigen::Vector2d& offset_mm, double ball_radius_mm);

/// What is known of the pictures and the gel, and which pixels of a press are samples.
struct PressSettings {
  double mm_per_px = 0.0;
  double gel_thickness_mm = 4.0;  ///< says how far the gel sinks round a ball (BallImprint)
  double rim_px = 1.0;     ///< pixels nearer to the circle's rim are left out: half of their light is from outside
  double most_lost = 0.5;  ///< share of the circle's pixels that may have two channels at 255; they are left out
};

/// A press whose figures were checked.
struct SeenPress {
  ContactCircle circle;
  bool found = false;  ///< the circle wasn't given
  cv::Mat difference;  ///< CV_32FC3, to the background, without the frame's gain
};

/// Finds the circle where none is given, and refuses what isn't one ball pressed there.
/// @param gain of the frame against the background (frame_gain.h)
/// @throws Error naming the press: an unfit frame; a scale, thickness or ball radius that isn't above 0; a ball more
///   than 10 times as wide as the picture; a circle that isn't finite, reaches over the picture's edge, is as large as
///   the ball or smaller than 4 px; nothing pressed in it; a second contact beside it
SeenPress see_press(const BallPress& press, const Background& background, const cv::Vec3d& gain,
                    const PressSettings& settings);

/// The pixels of the touched part within 0.9 of the ball's radius, colours as in the press's difference, not corrected
/// for the place.
/// @throws Error naming the press if too many are saturated
std::vector<ColourSample> samples_of(const BallPress& press, const SeenPress& seen, const PressSettings& settings);

/// Looks for the one ball that a picture shows: first where matt shading of its imprint explains most (BallSearch),
/// then the circle along which the picture is most a fine line: there the touched part ends, and the membrane's
/// slope falls at once. On 20 recorded presses of one ball on a GelSight Mini the radii came out within 1.5 px (RMS) of
/// their mean of 40; centres lie 2 to 3 px RMS from those drawn by hand.
/// @param difference to the background, CV_32FC3, without the frame's gain
/// @throws Error naming `name` if there's nothing, or a contact that touches the picture's edge
ContactCircle find_contact_circle(const cv::Mat& difference, const Background& background, double ball_radius_mm,
                                  const PressSettings& settings, const std::string& name);

}  // namespace touchstone::sensors
