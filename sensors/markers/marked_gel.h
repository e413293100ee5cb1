#pragma once

#include <opencv2/core/mat.hpp>
#include <span>

#include "sensors/heights/height_model.h"
#include "sensors/markers/marker_tracker.h"

namespace touchstone::sensors {

/// A calibration of heights for a gel with markers under the same light: its background becomes the mean of pictures of
/// the marked gel at rest, each with its markers painted over (marker_filling.h). The model's table goes from colour to
/// slope, so it may come from a gel without markers (the thesis [Li2015] doesn't say how it calibrates its second gel).
/// @throws Error as MarkerTracker::track and mean_background do; for pictures of another size than the model's
HeightModel for_marked_gel(HeightModel model, std::span<const cv::Mat> rest, const MarkerTrackerSettings& markers = {});

}  // namespace touchstone::sensors
