#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace touchstone::lab {

/// A file of a surface whose material is known.
struct LabelledMap {
  std::filesystem::path file;
  std::string material;
};

/// Reads a CSV with the header `file,material`; files are relative to `folder`. @throws Error with file and line
std::vector<LabelledMap> read_label_table(const std::filesystem::path& folder, const std::filesystem::path& csv);

}  // namespace touchstone::lab
