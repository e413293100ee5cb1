#pragma once
// Force and material of grasps on disk, by models of sensors/events/grasp_training.h.

#include <filesystem>
#include <string>
#include <vector>

#include "core/progress.h"
#include "sensors/events/event_source.h"
#include "sensors/events/grasp_force_reader.h"
#include "sensors/events/mains_flicker.h"
#include "sensors/events/material_classifier.h"

namespace touchstone::lab {

/// What came of one file of events.
struct GraspForceRecord {
  std::filesystem::path file;
  std::int64_t windows = 0, touched = 0, extrapolated = 0;
  double largest_N = 0.0;
  sensors::MainsFlicker flicker;  ///< before the touch
  std::string fault = {};         ///< why it was left out, or where it ends; windows before that are written
};

/// Reads each file a portion at a time, as from a camera, and writes FOLDER/STEM.csv, a line for each window of 7 ms
/// from the file's first event on: `t_us,on,off,touched,force_N,sigma_force_N,extrapolated`, t_us being the window's
/// end.
/// @throws Error for two files of one stem, for a model that reads other inputs, or if no file can be used
std::vector<GraspForceRecord> write_grasp_forces(const sensors::GraspForceModel& model,
                                                 const std::vector<std::filesystem::path>& files,
                                                 const sensors::EventReadOptions& options,
                                                 const std::filesystem::path& folder, const Progress& progress = {});

/// The material of one grasp, or why it can't be said.
struct GraspMaterialRecord {
  std::filesystem::path file;
  std::string material;
  double probability = 0.0;
  std::string fault = {};
};

/// Writes `csv`: `file,material,probability,fault`, a line for each file. @throws Error if no file can be used
std::vector<GraspMaterialRecord> write_grasp_materials(const sensors::MaterialClassifier& model,
                                                       const std::vector<std::filesystem::path>& files,
                                                       const sensors::EventReadOptions& options,
                                                       const std::filesystem::path& csv, const Progress& progress = {});

}  // namespace touchstone::lab
