#pragma once
// When a grasp touches, holds and lets go, seen from counts alone: [Naeini2020, sec. III.B and V.B].
//
// First touch is "when the first significant number of negative events are triggered", the release begins with the
// first significant spike of positive ones. The paper doesn't say what is significant. Here: what the background's
// Poisson rate would give less often than `false_alarm` in one window. The rate isn't known but from N events in B
// windows before; given the sum of both, the count c of one more window of the same rate is binomial, one part in B + 1
// (the exact test of two Poisson rates [Przyborowski1940]), so the least c with P(Binomial(N + c, 1 / (B + 1)) >= c) <
// false_alarm is a burst. Counts that scatter by more than Poisson's (variance over mean v > 1: vibration, flicker) are
// divided by v first (quasi-Poisson).
//
// The background of the touch is the beginning of the recording; that of the release is the last windows before, one
// window after the other, because vibration fades in the hold.
//
// The paper has phases by number, windows 1 to 22 and 23 to 144, "144 timestamps" a grasp in its fig. 8 with release
// and all, and a hold of 700 ms, which is 100 windows: 22 + 100 + 22 = 144. So its release must begin near window 123,
// and 'hold up to 144' can't be meant; the release is looked for here, and taken to be as long as the grasp.

#include <cstdint>
#include <span>

#include "sensors/events/event_windows.h"

namespace touchstone::sensors {

/// What counts as significant, and how many windows a phase has.
struct GraspPhaseSettings {
  int background_windows = 20;  ///< 140 ms; at least 2
  double false_alarm = 1e-6;  ///< in a window; above 0, below 0.5. Searching 1000 windows then errs once in 1000 grasps
  std::int64_t least_events = 1;  ///< a burst has so many, however quiet the background; at least 1
  int grasp_windows = 22;         ///< from first touch on, 154 ms; at least 1
  int least_hold_windows = 20;    ///< in which no release is looked for; at least background_windows
  int release_windows = 22;       ///< at least 1
};

/// Windows by number; a phase ends where the next begins.
struct GraspPhases {
  int first_touch = 0;  ///< the grasping phase begins
  int hold_begin = 0;
  int release_begin = 0;
  int release_end = 0;                 ///< first window after the releasing phase
  std::int64_t touch_threshold = 0;    ///< OFF events that were needed for the touch
  std::int64_t release_threshold = 0;  ///< ON events that were needed for the release
};

/// The least count that is a burst after such a background. @pre at least 2 counts, none negative; 0 < false_alarm <
/// 0.5
std::int64_t burst_threshold(std::span<const std::int64_t> background, double false_alarm);

/// The OFF events that a window needs to be first touch, against these windows of the scene at rest.
/// @throws Error for fewer than two windows, or a setting out of range
std::int64_t touch_threshold_of(std::span<const EventCounts> background, const GraspPhaseSettings& settings);

/// The first window after the background whose OFF events are a burst against it, or -1.
/// @throws Error for fewer windows than the background's, or a setting out of range
int find_first_touch(std::span<const EventCounts> windows, const GraspPhaseSettings& settings);

/// All phases. @throws Error if there's no touch, no release, or the recording ends within the grasp or the release
GraspPhases find_grasp_phases(std::span<const EventCounts> windows, const GraspPhaseSettings& settings = {});

}  // namespace touchstone::sensors
