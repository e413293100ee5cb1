#pragma once
// A file read in place: the system brings in the pages that are touched, and all processes that map it share them.

#include <cstddef>
#include <filesystem>
#include <memory>

namespace touchstone {

/// The bytes of a file, never to be changed; they live as long as any copy of `bytes`. If the file is replaced by
/// renaming another over it, the old bytes stay. If somebody cuts the file itself short, touching what is gone ends the
/// program (SIGBUS): files that are written whole, as write_whole_file does, are never cut.
struct MappedFile {
  std::shared_ptr<const char> bytes;
  std::size_t size = 0;
};

/// Maps the whole file for reading. An empty file has no bytes. @throws Error if it can't be read or is no file
/// (core/input_file.h)
MappedFile map_file(const std::filesystem::path& path);

}  // namespace touchstone
