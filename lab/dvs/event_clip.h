#pragma once
// The clip that event emulators are compared on: 346x260 pixels that see a sinusoid of 10 Hz and of another phase each,
// 1000 frames a second. On such a clip v2e [Hu2021] made 226 frames/s without noise and 97 with it on one thread.

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "render/events/event_pixels.h"

namespace touchstone::lab {

inline constexpr int kEventClipWidth = 346;                  ///< px
inline constexpr int kEventClipHeight = 260;                 ///< px
inline constexpr std::int64_t kEventClipInterval_us = 1000;  ///< between two frames
inline constexpr double kV2eIdealFrames_s = 226.0;           ///< frames/s of v2e without noise
inline constexpr double kV2eNoisyFrames_s = 97.0;            ///< and with noise

/// The frames of one period, CV_32FC1.
std::vector<cv::Mat> event_clip();

/// Pixels without noise, and with all there is of it.
render::EventPixelSettings event_clip_ideal();
/// With leak and shot noise, a limited bandwidth and a refractory time.
render::EventPixelSettings event_clip_noisy();

/// How many events ideal pixels give from frame 0 to the given one: between two turns of the light, as many as whole
/// thresholds fit between the last event's level and the turn.
double event_clip_count(std::int64_t last_frame, double threshold);

}  // namespace touchstone::lab
