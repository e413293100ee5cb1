#pragma once
// Objects by the names of their files, so that a name that is given again is the same object: sensors keep what they
// have made of one, and of a relief that takes a second.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "python/src/sensor.h"

namespace touchstone::python {

/// The last few objects that were read. The caller holds the GIL.
class NamedObjects {
 public:
  /// The object of a file: the one that was read before if neither the file nor a mesh or picture that it names has
  /// changed since (time of writing, size). @throws Error as sim::read_object
  SharedObject of(const std::filesystem::path& file);

 private:
  struct FileState {
    std::filesystem::path file;
    std::filesystem::file_time_type written;
    std::uintmax_t size;
    bool operator==(const FileState&) const = default;
  };
  struct Known {
    std::filesystem::path file;
    std::vector<FileState> files;
    SharedObject object;
  };
  static std::optional<FileState> state_of(const std::filesystem::path& file);

  std::vector<Known> known_;
};

}  // namespace touchstone::python
