#pragma once
// What event pixels and a motion chip make of a press, from the light of its states.

#include <cstdint>
#include <functional>
#include <opencv2/core/mat.hpp>
#include <span>
#include <vector>

#include "core/frame.h"
#include "core/motion_chip.h"
#include "fem/elements/compliance.h"
#include "render/events/event_pixels.h"
#include "render/imager/motion_chip.h"
#include "sim/press/truth.h"
#include "sim/sensor/light_between.h"

namespace touchstone::sim {

/// The light of a state: electrons a second that it frees in each pixel, CV_32FC1.
using Photocurrent = std::function<cv::Mat(const fem::PressState& press)>;

/// The events from the first state's time to the last one's. Between two states there are as many pictures as no pixel
/// changes by half the smallest threshold from one to the next (at most 8; the states in between are straight, see
/// state_between); between pictures the logarithm runs straight. The same bytes for any number of threads.
/// @pre at least one state, times rising
std::vector<Event> events_of_press(std::span<const Truth> states, const Photocurrent& light,
                                   const render::EventPixelSettings& pixels, std::uint64_t unit_seed,
                                   std::uint64_t noise_seed);

/// The same by pictures that are moved from state to state (sim/sensor/light_between.h), as watch_events has them.
std::vector<Event> events_of_press(std::span<const Truth> states, const LightOfKeys& light, const fem::Compliance& gel,
                                   const render::EventPixelSettings& pixels, std::uint64_t unit_seed,
                                   std::uint64_t noise_seed);

/// A chip's last frame and its statistics; dx and dy are summed since the device was at rest.
struct ChipTouch {
  cv::Mat raw;  ///< CV_8UC1, 0 to 63
  ChipStatistics statistics;
};

/// Shows the chip the untouched device until its shutter has settled, then each state's light for a frame, then the
/// last state's until the shutter has settled once more.
ChipTouch chip_touch(const render::MotionChipSettings& chip, const cv::Mat& rest_light, std::span<const cv::Mat> lights,
                     std::uint64_t unit_seed, std::uint64_t noise_seed);

}  // namespace touchstone::sim
