#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

namespace touchstone {

/// Reads a whole file. @throws Error if it can't be read or is no file (core/input_file.h)
std::string read_whole_file(const std::filesystem::path& path);

/// Writes a file so that it's there whole or not at all: `write` fills a temporary file beside `path`, which is then
/// renamed. If `write` throws, or the disk is full, the temporary file is removed and `path` is as it was.
void write_whole_file(const std::filesystem::path& path,
                      const std::function<void(const std::filesystem::path& temporary)>& write);

/// The same, with this content.
void write_whole_file(const std::filesystem::path& path, std::string_view content);

}  // namespace touchstone
