#pragma once
// Files that other files name.

#include <filesystem>
#include <string>

#include "core/yaml_reader.h"

namespace touchstone {

/// What hinders that a path is read as a file, in words: "there is no file a.yaml", "a.yaml is a pipe or a device; only
/// files are read"; empty if nothing does.
std::string fault_of_file(const std::filesystem::path& path);

/// The file that a text names which stands under `key` in `in`, relative to the folder of `in`'s own file.
/// @throws Error at the place of `key` for a file with a fault
std::filesystem::path named_file(const YamlReader& in, const std::string& key, const std::string& name);

}  // namespace touchstone
