#pragma once

#include <filesystem>
#include <string>

#include "sensors/learning/gaussian_process.h"

namespace touchstone::sensors {

/// The model as JSON (format "touchstone.gaussian_process", version 1) with a checksum (sensors/models/sealed_json.h).
/// Parameters and samples are kept; what follows from them isn't. Numbers are written so that reading gives the same
/// bits.
/// @throws Error if the model is faulty
std::string to_json(const GaussianProcess& process);

/// Reads what to_json wrote; `name` stands for the file in messages. It is conditioned anew, which takes condition()'s
/// time.
/// @throws Error naming file and field: not JSON, another format or version, a checksum that doesn't fit, a field
///   missing, unknown or of the wrong kind or length, a value that isn't finite, a faulty model
GaussianProcess gaussian_process_from_json(const std::string& text, const std::string& name);

/// Writes the file whole or not at all.
void save(const GaussianProcess& process, const std::filesystem::path& path);
/// @throws Error as gaussian_process_from_json, or if the file can't be read
GaussianProcess load_gaussian_process(const std::filesystem::path& path);

}  // namespace touchstone::sensors
