#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "sensors/tractions/marker_compliance.h"

namespace touchstone::sensors {

/// The map as bytes (format "touchstone.marker_compliance", version 1): a line of JSON with the grids, sizes and
/// material and the SHA-256 of what follows; then, as little-endian float64, the markers' rest positions (x, y, z of
/// each) and the matrix column by column. Reading gives the same bits. @throws Error if the map is faulty (fault_of)
std::string to_bytes(const MarkerCompliance& compliance);

/// Reads what to_bytes wrote; `name` stands for the file in messages.
/// @throws Error naming file and field: another format or version, a field missing, unknown or of the wrong kind, a
///   length or checksum that doesn't fit, a faulty map
MarkerCompliance marker_compliance_from_bytes(std::string_view bytes, const std::string& name);

/// Writes the file whole or not at all.
void save(const MarkerCompliance& compliance, const std::filesystem::path& path);
/// @throws Error as marker_compliance_from_bytes, or if the file can't be read
MarkerCompliance load_marker_compliance(const std::filesystem::path& path);

}  // namespace touchstone::sensors
