#pragma once

#include <opencv2/core/mat.hpp>

#include "sensors/markers/touch_reader.h"

namespace touchstone::sensors {

/// How a touch is drawn.
struct TouchOverlay {
  double full_force_N = 5.0;  ///< of the whole bar; above 0
};

/// Draws over a picture what is read from its frame: the contact's ellipse, green where the frame is to be trusted, red
/// where it isn't; a bar at the right edge as high as the normal force, with its error, where that is known; below, in
/// words, force on the object and slip.
/// @param picture 8 bit BGR, of the frame's size @throws Error for another picture or a setting out of its range
void draw_touch(const TouchReading& touch, cv::Mat& picture, const TouchOverlay& how = {});

}  // namespace touchstone::sensors
