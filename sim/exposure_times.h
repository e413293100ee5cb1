#pragma once
// The moments between frames that a camera's exposure takes light from.

#include <cstdint>
#include <vector>

#include "sim/plan.h"
#include "sim/virtual_sensor.h"

namespace touchstone::sim {

/// When frame number `frame` begins, in whole microseconds.
std::int64_t frame_time_us(int frame, double frame_rate_Hz);

/// How long a frame gathers light, s: the exposure, if its blur is simulated, and what the last row lags behind the
/// first, if that is; 0 if neither.
double exposure_window_s(const SceneSpec& scene, const Plan& plan);

/// Hands a played state to all frames before it whose exposure it is wanted for (Truth::later).
void keep_within_exposures(std::vector<Truth>& truths, double now_s, double window_s, double frame_rate_Hz,
                           const fem::PressState& state);

/// The state `after_s` after a frame's begin, straight between those that are known; after the motion's end its last.
fem::PressState state_after(const Truth& truth, double after_s);

/// The moments, s after a frame's begin, at which its light is computed: evenly over the window, so densely that
/// nothing moves more than half a pixel from one to the next, at least two and at most 65. A single one, the begin,
/// where nothing moves by more than the scene's `light.motion_tolerance_px`.
std::vector<double> exposure_times(const SceneSpec& scene, const Truth& truth, double window_s);

}  // namespace touchstone::sim
