#include "sensors/events/grasp_sequence.h"

#include "core/error.h"

namespace touchstone::sensors {

const char* name_of(Accumulation accumulation) {
  switch (accumulation) {
    case Accumulation::kThroughHold:
      return "through hold";
    case Accumulation::kSkipHold:
      return "skip hold";
  }
  return "?";
}

GraspSequence grasp_sequence(std::span<const EventCounts> windows, const GraspPhases& phases,
                             std::int64_t window_length_us, Accumulation accumulation) {
  if (!(phases.first_touch >= 0 && phases.first_touch < phases.hold_begin &&
        phases.hold_begin <= phases.release_begin && phases.release_begin < phases.release_end)) {
    fail("grasp sequence: phases at windows {}, {}, {} and {}; each must come after the one before", phases.first_touch,
         phases.hold_begin, phases.release_begin, phases.release_end);
  }
  if (static_cast<std::size_t>(phases.release_end) > windows.size()) {
    fail("grasp sequence: the release ends at window {}, there are {}", phases.release_end, windows.size());
  }
  if (window_length_us < 1) fail("grasp sequence: windows of {} us; they must be at least 1 us long", window_length_us);
  GraspSequence sequence;
  sequence.grasp_windows = phases.hold_begin - phases.first_touch;
  const bool skips = accumulation == Accumulation::kSkipHold;
  const int hold = phases.release_begin - phases.hold_begin;
  const Eigen::Index size = phases.release_end - phases.first_touch - (skips ? hold : 0);
  sequence.counts.resize(size, 2);
  sequence.time_s.resize(size);
  std::int64_t on = 0;
  std::int64_t off = 0;
  Eigen::Index row = 0;
  for (int window = phases.first_touch; window < phases.release_end; ++window) {
    const bool held = window >= phases.hold_begin && window < phases.release_begin;
    if (held && skips) continue;
    on += windows[static_cast<std::size_t>(window)].on;
    off += windows[static_cast<std::size_t>(window)].off;
    sequence.counts.row(row) << static_cast<double>(on), static_cast<double>(off);
    sequence.time_s[row] = 1e-6 * static_cast<double>(window_length_us) * (window + 1 - phases.first_touch);
    if (!held) sequence.judged.push_back(static_cast<int>(row));
    ++row;
  }
  return sequence;
}

}  // namespace touchstone::sensors
