#pragma once

#include <opencv2/core/mat.hpp>
#include <span>

#include "core/frame.h"

namespace touchstone::sim {

/// Events to look at, CV_8UC3 (BGR): white where none came, red the more ON events came than OFF events, blue the
/// opposite sign, grey where as many came of both; four events give the full colour. @pre events lie inside `size`
cv::Mat event_picture(std::span<const Event> events, cv::Size size);

}  // namespace touchstone::sim
