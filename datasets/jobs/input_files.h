#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/yaml_reader.h"

namespace touchstone::datasets {

/// A file that a job's result depends on.
struct InputFile {
  std::string name;  ///< relative to the folder of the file that it all began with, with forward slashes
  std::string sha256;
};

/// All files that a job or scene file names, directly or through others, with their checksums, sorted by name; the
/// file itself is the one named by its own file name. A file counts as named where any text in a YAML or glTF file,
/// taken relative to that file's folder, is the path of an existing file: so no list of keys has to be kept here.
/// @throws Error if a file can't be read or isn't YAML
std::vector<InputFile> input_files(const std::filesystem::path& root);

/// Reads the field `key` as a file's name, relative to the folder of the file it stands in.
/// @throws Error with file and line if there is no such file
std::filesystem::path existing_file(YamlReader& in, const std::string& key);

}  // namespace touchstone::datasets
