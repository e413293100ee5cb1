#pragma once
// Played paths on disk.

#include <filesystem>
#include <string>

#include "sim/press/press_path.h"

namespace touchstone::sim {

/// SHA-256 over all that the states depend on.
std::string press_path_key(const std::string& gel_key, const PressPath& path);

/// Whole or not at all. @throws Error if it can't be written
void write_press_path(const std::filesystem::path& file, const std::string& key, const PlayedPath& played);

/// @throws Error that says, as the second half of a sentence, why the file can't be used
PlayedPath read_press_path(const std::filesystem::path& file, const std::string& key);

}  // namespace touchstone::sim
