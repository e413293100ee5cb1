#pragma once

#include <filesystem>
#include <string>

#include "sensors/beads/stiffness_force_model.h"

namespace touchstone::sensors {

/// The model as JSON (format "touchstone.stiffness_force_model", version 1). Numbers are written so that reading
/// gives the same bits. @throws Error if the model is faulty (fault_of)
std::string to_json(const StiffnessForceModel& model);

/// Reads what to_json wrote; `name` stands for the file in messages.
/// @throws Error naming file and field: not JSON, another format or version, a field missing, unknown or of the wrong
///   kind or length, a value that isn't finite, an entry that the form forbids
StiffnessForceModel stiffness_model_from_json(const std::string& text, const std::string& name);

/// Writes the file whole or not at all.
void save(const StiffnessForceModel& model, const std::filesystem::path& path);
/// @throws Error as stiffness_model_from_json, or if the file can't be read
StiffnessForceModel load_stiffness_model(const std::filesystem::path& path);

}  // namespace touchstone::sensors
