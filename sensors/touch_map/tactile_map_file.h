#pragma once
// Tactile maps as files. A line that names the format and version, one of JSON that describes the map, then the heights
// and the weights as little endian 32 bit floats, row by row.

#include <filesystem>
#include <string>
#include <string_view>

#include "sensors/touch_map/tactile_map.h"

namespace touchstone::sensors {

/// The file's bytes. @throws Error for data that `check` refuses
std::string to_bytes(const TactileMapData& data);

/// `name` stands for the file in errors. @throws Error for what isn't such a file, another version, a file that is cut
/// short or longer than it says, a wrong checksum, or data that `check` refuses
TactileMapData tactile_map_from_bytes(std::string_view bytes, const std::string& name);

/// @throws Error if the file can't be written
void save(const TactileMapData& data, const std::filesystem::path& path);

/// @throws Error as `tactile_map_from_bytes` does, or if the file can't be read
TactileMapData load_tactile_map(const std::filesystem::path& path);

}  // namespace touchstone::sensors
