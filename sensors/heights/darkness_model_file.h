#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "sensors/heights/darkness_model.h"

namespace touchstone::sensors {

/// The model as bytes (format "touchstone.darkness_model", version 1): a line of JSON with sizes, scale, curve and the
/// SHA-256 of what follows: the rest picture's brightness (little-endian float32, row by row). Reading gives the same
/// bits. @throws Error if the model is faulty (fault_of)
std::string to_bytes(const DarknessModel& model);

/// Reads what to_bytes wrote; `name` stands for the file in messages.
/// @throws Error naming file and field: another format or version, a field missing, unknown or of the wrong kind, a
///   length or checksum that doesn't fit, a faulty model
DarknessModel darkness_model_from_bytes(std::string_view bytes, const std::string& name);

/// Writes the file whole or not at all.
void save(const DarknessModel& model, const std::filesystem::path& path);
/// @throws Error as darkness_model_from_bytes, or if the file can't be read
DarknessModel load_darkness_model(const std::filesystem::path& path);

}  // namespace touchstone::sensors
