#pragma once
// Grasps on disk: files of events, of any kind that sensors/events/event_file.h reads, with forces and materials.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/progress.h"
#include "sensors/events/event_source.h"
#include "sensors/events/event_windows.h"
#include "sensors/events/known_grasp.h"

namespace touchstone::lab {

/// A line of a table of grasps.
struct GraspFiles {
  std::filesystem::path events;
  std::filesystem::path forces;  ///< of datasets::read_force_readings; empty where the table has none
  std::string material;          ///< likewise
};

/// What a table of grasps must say.
enum class GraspNeeds { forces, materials };

/// A CSV with the header `events,forces,material`, files relative to its folder; cells that aren't needed may be empty.
/// @throws Error with file and line
std::vector<GraspFiles> read_grasp_table(const std::filesystem::path& csv, GraspNeeds needs);

/// Grasps that can be used, and what is wrong with the others.
struct SeenGrasps {
  std::vector<sensors::KnownGrasp> seen;
  std::vector<std::string> faults;  ///< naming the file: damaged, no touch, no release, forces that end too early
};

/// Windows of 7 ms, as in [Naeini2020], from the recording's first event on.
/// @param options what files don't say of their camera. @throws Error if no grasp can be used
SeenGrasps read_grasps(const std::vector<GraspFiles>& table, const sensors::EventReadOptions& options,
                       const Progress& progress = {});

/// The windows that the commands use, for a file's camera and first event. @throws Error naming the file if its
/// camera's size isn't known, or there is no event
sensors::EventWindowSettings windows_for(const std::filesystem::path& events, const sensors::EventReadOptions& options);

}  // namespace touchstone::lab
