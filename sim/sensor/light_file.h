#pragma once
// What a sensor found out about its light, kept: the light field, the bounced light, and how far they are off.

#include <filesystem>
#include <optional>
#include <string>

#include "sim/sensor/direct_light.h"

namespace touchstone::sim {

/// Raised with each change of the file's layout, or of how light is found.
inline constexpr int kLightFormat = 5;

/// `light-<key>.bin`. @pre `key` is a SHA-256 in hexadecimal digits
std::filesystem::path light_file(const std::filesystem::path& folder, const std::string& key);

/// Writes the file whole or not at all. @throws Error if it can't
void write_light(const std::filesystem::path& folder, const std::string& key, const FoundLight& light);

/// Bit for bit what was written; nothing if it isn't there, is damaged or belongs to another key.
std::optional<FoundLight> read_light(const std::filesystem::path& folder, const std::string& key);

}  // namespace touchstone::sim
