#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>

#include "sensors/colour/colour_marker.h"
#include "sensors/colour/hue_estimator.h"

namespace touchstone::sensors {

/// What is drawn besides markers, and how.
struct ColourOverlay {
  double arrow_scale = 1.0;                     ///< px of an arrow for a px of displacement; above 0
  std::optional<Eigen::Vector3d> force_N = {};  ///< in words
  std::string words = {};                       ///< after it: slip
};

/// Draws into `picture`, which becomes 8-bit BGR of the frame's size: the frame, a ring round each marker where its ink
/// is, green where it was measured, yellow where calibration has seen none like it, red where it rests if it's flawed;
/// an arrow from where it was at rest; below, force and words.
/// @param rest, seen of the same grid; `field` the estimate of `seen`
/// @throws Error unless the frame is 8 bit BGR, or for a scale out of its range
void draw_overlay(const cv::Mat& frame, const ColourMarkerReading& rest, const ColourMarkerReading& seen,
                  const HueField& field, cv::Mat& picture, const ColourOverlay& how = {});

}  // namespace touchstone::sensors
