#pragma once
// Slip on a gelsight device with markers [Li2015, sec. 4.4]: objects that slide, and objects that don't, seen by the
// thesis's two ratios and by the incipient slip detector, against the stick-slip map of the finite elements.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sensors/heights/height_model.h"
#include "sensors/markers/gel_force_model.h"
#include "sensors/markers/touch_reader.h"
#include "sim/sensor/virtual_sensor.h"

namespace touchstone::lab {

/// How the object is moved.
enum class SlipMotion {
  slide,  ///< pressed, held, then dragged along x until it slides
  hold,   ///< pressed and held
  load,   ///< pressed, then loaded along x to a part of what friction holds, and held
  roll,   ///< a ball pressed, then rolled in along x
};

/// An object, how hard it is pressed and how it moves.
struct SlipCase {
  sim::ObjectSpec object;  ///< with its friction
  double normal_N = 0.5;
  SlipMotion motion = SlipMotion::slide;
  double speed_mm_per_s = 2.0;  ///< slide and roll
  double part_of_limit = 0.5;   ///< load

  /// Motion, object, friction, force and speed, for a table's row.
  std::string name() const;
};

/// What one frame showed, and what was true.
struct SlipFrame {
  double t_s = 0.0;
  double load = 0.0;      ///< true: shear force over friction times normal force
  double sticking = 0.0;  ///< true: share of the touching vertices
  std::optional<double> force_ratio, motion_ratio;
  bool rule = false;           ///< the thesis's detector
  sensors::IncipientSlip rim;  ///< the second one
  int markers_found = 0;
};

/// One case, frame by frame, with the truth of when it slips.
struct SlipRun {
  SlipCase what;
  std::vector<SlipFrame> frames;
  std::optional<double> onset_s;    ///< of gross sliding: the first state in which no touching vertex sticks
  std::optional<double> partial_s;  ///< of partial slip in a slide: the first state of the drag in which a tenth of the
                                    ///< vertices that stuck before it no longer do
};

/// What the two detectors are made of.
struct SlipEstimators {
  sensors::HeightModel heights;   ///< of this gel
  sensors::GelForceModel forces;  ///< with a line for each object by its name, and one for shear
  sensors::TouchReaderSettings settings = {};
};

/// Plays and judges one case at the device's frame rate; states come four times as often, so the onset is known to a
/// quarter of a frame. A slide ends `frames_after` frames after its onset.
SlipRun run_slip_case(const sim::VirtualSensor& sensor, const SlipCase& what, const SlipEstimators& estimators,
                      std::uint64_t seed, int frames_after = 10);

/// How one detector did over many runs.
struct SlipScore {
  int slides = 0;                 ///< runs with an onset
  int found = 0;                  ///< in which slip was reported at all
  int found_before = 0;           ///< not later than the onset
  std::vector<double> delays_ms;  ///< report - onset of those found; negative: before
  int predictable = 0;   ///< slides whose partial slip lasts as long as score() is given: there's time to see it
  int predicted = 0;     ///< of those, found not later than the onset
  int quiet_runs = 0;    ///< without an onset
  int false_runs = 0;    ///< of those, with a report
  int quiet_frames = 0;  ///< frames of quiet runs, and of the others' before any shear
  int false_frames = 0;

  double median_delay_ms() const;       ///< NaN if none was found
  double false_alarms_percent() const;  ///< false over quiet frames
};

/// All frames of all runs as CSV, a line each: case, onset, time, true load and sticking share, both ratios, lag,
/// verdicts.
std::string to_csv(const std::vector<SlipRun>& runs);

/// The thesis's two ratios, or lag at the contact's rim.
enum class SlipDetector { rule, incipient };
/// A detector reports from its first frame on that says slip; frames before an object's shear load reaches a twentieth
/// of its limit are quiet ones. `least_warning_s`: how long partial slip has to last for SlipScore::predictable.
SlipScore score(const std::vector<SlipRun>& runs, SlipDetector detector, double least_warning_s = 0.0);

}  // namespace touchstone::lab
