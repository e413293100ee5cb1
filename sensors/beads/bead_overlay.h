#pragma once
// What a tracker and a force model make of a frame, drawn over it: the picture for a user's window.

#include <opencv2/core/mat.hpp>

#include "sensors/beads/bead_tracker.h"
#include "sensors/beads/stiffness_force_model.h"

namespace touchstone::sensors {

/// How large rings and arrow are drawn.
struct BeadOverlay {
  double px_per_N = 40.0;  ///< length of the arrow of the force along x and y; above 0
  int ring_px = 12;        ///< radius of the ring round each bead; above 0
};

/// Draws into `picture`, which becomes 8-bit BGR of the frame's size (memory of that kind is used again): the frame,
/// 16 bit by its upper 8; a ring round each bead, green where it was found, red where it's hidden or reset; from their
/// middle an arrow along the force on the x and y axes of the picture, and the three components in N as text. The frame
/// isn't changed, unless it is `picture` itself.
/// @throws Error for an image of another type than BeadTracker takes, or a setting out of its range
void draw_overlay(const cv::Mat& frame, const TrackedBeads& beads, const ForceEstimate& force, cv::Mat& picture,
                  const BeadOverlay& how = {});

}  // namespace touchstone::sensors
