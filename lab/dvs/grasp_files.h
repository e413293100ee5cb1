#pragma once
// Grasps on disk: files of events, of any kind that sensors/events/event_file.h reads, with forces and materials.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/progress.h"
#include "sensors/events/event_source.h"
#include "sensors/events/event_windows.h"
#include "sensors/events/force_readings.h"
#include "sensors/events/force_series.h"
#include "sensors/events/grasp_sequence.h"
#include "sensors/events/material_classifier.h"

namespace touchstone::lab {

/// A line of a table of grasps.
struct GraspFiles {
  std::filesystem::path events;
  std::filesystem::path forces;  ///< empty where the table has none
  std::string material;          ///< likewise
};

/// What a table of grasps must say.
enum class GraspNeeds { forces, materials };

/// A CSV with the header `events,forces,material`, files relative to its folder; cells that aren't needed may be empty.
/// @throws Error with file and line
std::vector<GraspFiles> read_grasp_table(const std::filesystem::path& csv, GraspNeeds needs);

/// Forces beside a recording: a CSV with the header `t_us,force_N`, in the order of time, on the events' clock.
/// @throws Error with file and line
sensors::ForceReadings read_force_readings(const std::filesystem::path& csv);

/// A grasp from first touch to the end of its release.
struct SeenGrasp {
  GraspFiles files;
  sensors::GraspSequence sequence;
  Eigen::VectorXd force_N;  ///< mean of each of the sequence's windows; empty without forces
};

/// Grasps that can be used, and what is wrong with the others.
struct SeenGrasps {
  std::vector<SeenGrasp> seen;
  std::vector<std::string> faults;  ///< naming the file: damaged, no touch, no release, forces that end too early
};

/// Windows of 7 ms, as in [Naeini2020], from the recording's first event on.
/// @param options what files don't say of their camera. @throws Error if no grasp can be used
SeenGrasps read_grasps(const std::vector<GraspFiles>& table, const sensors::EventReadOptions& options,
                       const Progress& progress = {});

/// The windows that the commands use, for a file's camera and first event. @throws Error naming the file if its
/// camera's size isn't known, or there is no event
sensors::EventWindowSettings windows_for(const std::filesystem::path& events, const sensors::EventReadOptions& options);

/// Inputs and force of the judged windows. @param with_time for a Gaussian process: ON, OFF and time; else counts
std::vector<sensors::ForceSeries> force_series_of(const std::vector<SeenGrasp>& grasps, bool with_time);

/// Counts of the judged windows, with the index of the grasp's material in `materials`, which is filled by first
/// appearance.
std::vector<sensors::MaterialSample> material_samples_of(const std::vector<SeenGrasp>& grasps,
                                                         std::vector<std::string>& materials);

}  // namespace touchstone::lab
