#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "datasets/sources/table_frames.h"

namespace touchstone::lab {

/// A file of a surface whose material is known.
struct LabelledMap {
  std::filesystem::path file;
  std::string material;
};

/// Reads a CSV with the header `file,material`; files are `frames`. @throws Error with file and line
std::vector<LabelledMap> read_label_table(datasets::TableFrames& frames, const std::filesystem::path& csv);

}  // namespace touchstone::lab
