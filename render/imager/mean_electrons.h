#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "render/imager/imager.h"

namespace touchstone::render {

/// Of each of the imager's channels (rows of its quantum efficiency), as if it were a sensor of its own.
std::vector<ImagerResponse> channel_responses(const Imager& imager);

/// Mean electrons that light frees, without noise and full well: CV_32FC(channels), as if each pixel had all channels.
/// @param irradiance CV_32FC(bands), W/m^2
/// @param channels as channel_responses() gives them
cv::Mat mean_electrons(const cv::Mat& irradiance, const std::vector<ImagerResponse>& channels);

}  // namespace touchstone::render
