#pragma once
// What a tracker makes of a frame, drawn over it: the picture for a user's eyes.

#include <opencv2/core/mat.hpp>

#include "sensors/markers/marker_tracker.h"

namespace touchstone::sensors {

/// How arrows are drawn.
struct MarkerOverlay {
  double arrow_scale = 1.0;  ///< px of an arrow for a px of displacement; above 0
};

/// Draws into `picture`, which becomes 8-bit BGR of the frame's size: the frame, a ring round each marker where it is,
/// and an arrow from where it was at rest along its displacement. Green where the marker is trusted, red where its
/// place is only held. The frame isn't changed, unless it is `picture` itself.
/// @throws Error unless the frame is 8 bit, grey or BGR, or for a scale out of its range
void draw_overlay(const cv::Mat& frame, const TrackedMarkers& markers, const MarkerAppearance& appearance,
                  cv::Mat& picture, const MarkerOverlay& how = {});

}  // namespace touchstone::sensors
