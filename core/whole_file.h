#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

namespace touchstone {

/// Reads a whole file. @throws Error if it can't be read or is no file (core/input_file.h)
std::string read_whole_file(const std::filesystem::path& path);

/// Writes a file so that it's there whole or not at all: `write` fills a temporary file beside `path`, which is then
/// renamed. That file is there already, empty and under a name that can't be guessed: `write` opens it by its name. If
/// `write` throws or writes nothing, or the disk is full, the temporary file is removed and `path` is as it was.
/// @throws Error that names `path` if it can't be written
void write_whole_file(const std::filesystem::path& path,
                      const std::function<void(const std::filesystem::path& temporary)>& write);

/// The same, with this content.
void write_whole_file(const std::filesystem::path& path, std::string_view content);

/// The same for what others rely on after a loss of power: the bytes are on the disk before the file has its name, and
/// the name is there when this returns.
void write_lasting_file(const std::filesystem::path& path, std::string_view content);

/// Returns when a file's bytes, or a folder's names, are on the disk. @throws Error if they can't be brought there
void wait_for_disk(const std::filesystem::path& path);

}  // namespace touchstone
