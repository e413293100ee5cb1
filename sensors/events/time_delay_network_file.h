#pragma once

#include <filesystem>
#include <string>

#include "sensors/events/time_delay_network.h"

namespace touchstone::sensors {

/// The model as JSON (format "touchstone.time_delay_network", version 1) with a checksum
/// (sensors/models/sealed_json.h). Numbers are written so that reading gives the same bits.
/// @throws Error if the model is faulty (fault_of)
std::string to_json(const TimeDelayNetwork& model);

/// Reads what to_json wrote; `name` stands for the file in messages.
/// @throws Error naming file and field: not JSON, another format or version, a checksum that doesn't fit, a field
///   missing, unknown or of the wrong kind or length, a value that isn't finite, a faulty model
TimeDelayNetwork time_delay_network_from_json(const std::string& text, const std::string& name);

/// Writes the file whole or not at all.
void save(const TimeDelayNetwork& model, const std::filesystem::path& path);
/// @throws Error as time_delay_network_from_json, or if the file can't be read
TimeDelayNetwork load_time_delay_network(const std::filesystem::path& path);

}  // namespace touchstone::sensors
