#pragma once

#include <filesystem>
#include <string>

#include "sensors/colour/hue_model.h"

namespace touchstone::sensors {

/// The model as JSON (format "touchstone.hue_model", version 1). Numbers are written so that reading gives the same
/// bits. Of the line of [Lin2019, eq. 4] and the polynomials, the one that the form uses is written.
/// @throws Error if the model is faulty (fault_of)
std::string to_json(const HueModel& model);

/// Reads what to_json wrote; `name` stands for the file in messages.
/// @throws Error naming file and field: not JSON, another format or version, a field missing, unknown or of the wrong
///   kind or length, a value that isn't finite, a faulty model
HueModel hue_model_from_json(const std::string& text, const std::string& name);

/// Writes the file whole or not at all.
void save(const HueModel& model, const std::filesystem::path& path);
/// @throws Error as hue_model_from_json, or if the file can't be read
HueModel load_hue_model(const std::filesystem::path& path);

}  // namespace touchstone::sensors
