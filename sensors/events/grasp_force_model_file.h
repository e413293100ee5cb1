#pragma once

#include <filesystem>
#include <string>

#include "sensors/events/grasp_force_model.h"

namespace touchstone::sensors {

/// The model as JSON (format "touchstone.grasp_force_model", version 1) with a checksum (sensors/models/sealed_json.h);
/// within it the estimator as its own file has it. Numbers are written so that reading gives the same bits.
/// @throws Error if the model is faulty (fault_of)
std::string to_json(const GraspForceModel& model);

/// Reads what to_json wrote; `name` stands for the file in messages.
/// @throws Error naming file and field: not JSON, another format or version, a checksum that doesn't fit, a field
///   missing, unknown or of the wrong kind, an estimator of another format or that its own file couldn't hold, a faulty
///   model
GraspForceModel grasp_force_model_from_json(const std::string& text, const std::string& name);

/// Writes the file whole or not at all.
void save(const GraspForceModel& model, const std::filesystem::path& path);
/// @throws Error as grasp_force_model_from_json, or if the file can't be read
GraspForceModel load_grasp_force_model(const std::filesystem::path& path);

}  // namespace touchstone::sensors
