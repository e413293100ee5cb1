#pragma once
// A grasp as the estimators of [Naeini2020] see it: accumulated counts of the grasping and the releasing phase.
//
// "The events are accumulated over time to provide a full memory of the sequences" (sec. III.C), and the holding phase
// isn't considered (III.B). The paper leaves open whether what happens in the hold is in the memory, and in the delays,
// all the same. It is here unless asked otherwise, since an estimator that runs along with a grasp counts it.

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "sensors/events/event_windows.h"
#include "sensors/events/grasp_phases.h"

namespace touchstone::sensors {

/// Do the windows of the holding phase count in the memory?
enum class Accumulation : std::uint8_t {
  kThroughHold,  ///< from first touch on, all windows; those of the hold are there, but not judged
  kSkipHold,     ///< as if the release followed the grasping phase at once
};
/// "through hold", "skip hold"
const char* name_of(Accumulation accumulation);

/// The windows from first touch to the end of the release, one a row.
struct GraspSequence {
  Eigen::MatrixX2d counts;  ///< accumulated ON and OFF events, with those of the window itself
  Eigen::VectorXd time_s;   ///< from the begin of first touch's window to the end of this one
  std::vector<int> judged;  ///< rows of the grasping and of the releasing phase: those to train and to test on
  int grasp_windows = 0;    ///< of them, in the grasping phase: the first ones
};

/// @param window_length_us length of a window
/// @throws Error if a phase isn't within the windows or ends before it begins, or the length isn't above 0
GraspSequence grasp_sequence(std::span<const EventCounts> windows, const GraspPhases& phases,
                             std::int64_t window_length_us = 7'000,
                             Accumulation accumulation = Accumulation::kThroughHold);

}  // namespace touchstone::sensors
