#pragma once
// Grasps to learn from: what an event camera saw of each, and what a force sensor said beside it.

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "sensors/events/event_windows.h"
#include "sensors/events/force_readings.h"
#include "sensors/events/force_series.h"
#include "sensors/events/grasp_sequence.h"
#include "sensors/events/material_classifier.h"

namespace touchstone::sensors {

/// A grasp from first touch to the end of its release.
struct KnownGrasp {
  GraspSequence sequence;
  Eigen::VectorXd force_N = {};  ///< mean of each of the sequence's windows; empty where it isn't known
  std::string material = {};     ///< likewise
};

/// Finds a recording's grasp.
/// @param windows all of it, of these settings
/// @param readings sound ones, or null: forces aren't known. Messages call them `name`
/// @throws Error as find_grasp_phases, or for readings that end before the release does
KnownGrasp known_grasp(std::span<const EventCounts> windows, const EventWindowSettings& settings,
                       const ForceReadings* readings, const std::string& name = "forces");

/// Inputs and force of the judged windows. @param with_time for a Gaussian process: ON, OFF and time; else counts
ForceSeries force_series_of(const KnownGrasp& grasp, bool with_time);

/// Counts of the judged windows, with the index of the grasp's material in `materials`, which is filled by first
/// appearance.
MaterialSample material_sample_of(const KnownGrasp& grasp, std::vector<std::string>& materials);

}  // namespace touchstone::sensors
