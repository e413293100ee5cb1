#pragma once
// What an estimator makes of a frame, drawn beside it: the picture for a user's eyes.

#include <opencv2/core/mat.hpp>

#include "sensors/heights/darkness_estimator.h"
#include "sensors/heights/height_estimator.h"

namespace touchstone::sensors {

/// Draws into `picture`, which becomes 8-bit BGR, twice as wide as the frame: on the left the frame with the contact's
/// outline, on the right the heights from 0 (black) to `highest_mm` (white), with the same outline, and the highest one
/// in words. An outline is green where the frame is to be trusted, red where it isn't.
/// @throws Error unless the frame is 8 bit of 3 channels and of the result's size, or for a `highest_mm` that isn't
/// above 0
void draw_overlay(const cv::Mat& frame, const HeightResult& result, double highest_mm, cv::Mat& picture);

/// The same of a gel that shows depth as darkness, whose frame may be grey.
void draw_overlay(const cv::Mat& frame, const DarknessResult& result, double highest_mm, cv::Mat& picture);

}  // namespace touchstone::sensors
