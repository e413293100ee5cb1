#pragma once

#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "tests/support/temporary_folder.h"

namespace touchstone::fuzz {

/// This process' file of that name ("blocks/000000.h5"), with these bytes: for readers that want a path.
inline std::filesystem::path scratch_file(std::string_view bytes, const std::string& name) {
  static const test::TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / name;
  if (const auto within = file.parent_path(); within != folder.path()) std::filesystem::create_directories(within);
  std::ofstream(file, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  return file;
}

}  // namespace touchstone::fuzz
