#pragma once
// Recorded grasps as the estimators of [Naeini2020] see them: windows, phases, accumulated counts and forces.

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "lab/dvs/dvs_recordings.h"
#include "sensors/events/force_series.h"
#include "sensors/events/grasp_phases.h"
#include "sensors/events/grasp_sequence.h"
#include "sensors/events/material_classifier.h"

namespace touchstone::lab {

/// Which counts are taken, in which windows.
struct DvsSequenceSettings {
  int pixels = 0;     ///< which kind of DvsRecording::by_pixels
  int window_ms = 7;  ///< sec. III.B; at least 1
  sensors::Accumulation accumulation = sensors::Accumulation::kThroughHold;
};

/// The paper's phases in windows of another length: as much time as 22 windows of 7 ms, and so on.
/// @throws Error unless the length is 1 to 70 ms
sensors::GraspPhaseSettings dvs_phase_settings(int window_ms);

/// One grasp, from its first touch to the end of its release. All forces are means over windows.
struct DvsSequence {
  int material = 0;
  sensors::GraspPhases phases;
  sensors::GraspSequence windows;
  Eigen::VectorXd measured_N;     ///< by the reference sensor, with its errors: what the paper trains and tests on
  Eigen::VectorXd true_N;         ///< what the finger really pressed
  double touch_delay_ms = 0.0;    ///< from the true touch to the end of the window that shows it
  double release_delay_ms = 0.0;  ///< from the servo's order to open to the end of the window that shows it
  double apart_ms = 0.0;          ///< from the end of that window to the last moment of contact
};

/// The force of windows, from readings of their own length and time: the readings' course, straight from middle to
/// middle, taken at as many even moments of the window as readings fit in it. Before the first reading, which begins
/// with the touch, there is no force.
/// @throws Error if a window ends after the last reading does
Eigen::VectorXd window_forces(std::span<const sim::ForceReading> readings, double sim::ForceReading::*force,
                              double first_window_s, int window_ms, Eigen::Index windows);

/// Many grasps. A press so light that its events are lost in the noise has no touch to begin with.
struct DvsSequences {
  std::vector<DvsSequence> seen;
  std::vector<std::string> unseen;  ///< of each grasp that isn't, its noise seed and why: no touch, no release, no end
  double unseen_peak_N = 0.0;       ///< the hardest press (true force) among those
};
/// @throws Error for a kind of pixels that wasn't recorded, a window's length out of range, or readings that end before
/// the windows do
DvsSequences dvs_sequences(std::span<const DvsRecording> recordings, const DvsSequenceSettings& settings = {});

/// Which force is learned.
enum class DvsForce { measured, truth };

/// What estimators are given of a window.
enum class DvsInputs {
  counts,           ///< accumulated ON and OFF: networks
  counts_and_time,  ///< Gaussian processes (sec. III.D)
  time,             ///< a control: what can be estimated without having seen anything but the touch
};

/// Inputs and force of the judged windows, a series for each grasp.
std::vector<sensors::ForceSeries> force_series_of(std::span<const DvsSequence> sequences, DvsForce force,
                                                  DvsInputs inputs);

/// For the classifier: accumulated ON and OFF of the judged windows, or in their place the measured force of those.
std::vector<sensors::MaterialSample> event_samples(std::span<const DvsSequence> sequences);
/// The control: the measured force in place of the events.
std::vector<sensors::MaterialSample> force_sensor_samples(std::span<const DvsSequence> sequences);

}  // namespace touchstone::lab
