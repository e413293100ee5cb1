#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "sensors/heights/height_model.h"

namespace touchstone::sensors {

/// The model as bytes (format "touchstone.height_model", version 3): a line of JSON with sizes, scale, lamps, the
/// network if there is one, and the SHA-256 of what follows; then, little-endian, the background (float32, row by row,
/// BGR), the table's slopes (float32, u and v) and its hits (uint16). Reading gives the same bits. @throws Error if the
/// model is faulty (fault_of)
std::string to_bytes(const HeightModel& model);

/// Reads what to_bytes wrote; `name` stands for the file in messages.
/// @throws Error naming file and field: another format or version, a field missing, unknown or of the wrong kind, a
///   length or checksum that doesn't fit, a faulty model
HeightModel height_model_from_bytes(std::string_view bytes, const std::string& name);

/// Writes the file whole or not at all.
void save(const HeightModel& model, const std::filesystem::path& path);
/// @throws Error as height_model_from_bytes, or if the file can't be read
HeightModel load_height_model(const std::filesystem::path& path);

}  // namespace touchstone::sensors
