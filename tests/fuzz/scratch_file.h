#pragma once

#include <filesystem>
#include <fstream>
#include <string_view>

#include "tests/support/temporary_folder.h"

namespace touchstone::fuzz {

/// The one file of this process, with these bytes: for readers that want a path.
inline const std::filesystem::path& scratch_file(std::string_view bytes, const char* name) {
  static const test::TemporaryFolder folder;
  static const std::filesystem::path file = folder.path() / name;
  std::ofstream(file, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  return file;
}

}  // namespace touchstone::fuzz
