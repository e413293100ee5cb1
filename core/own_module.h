#pragma once
// Parts of Touchstone that are opened when they are first used, because the libraries that they link take long to load:
// picture files (OpenImageIO), videos (FFmpeg).

#include <filesystem>
#include <string>

namespace touchstone {

/// A module of ours.
struct OwnModule {
  std::string name;             ///< its file's
  std::filesystem::path built;  ///< where it was built
  std::string purpose;          ///< for messages: "image files"
  const char* symbol;           ///< its function that returns its table
};

/// Opens a module and gives what its function returns. It stays open to the end of the process: the libraries in it
/// start threads that can't be taken back. Looked for beside the file that this code is in, as in a folder that was
/// moved; where Touchstone is installed; where it was built.
/// @throws Error if it's missing or can't be loaded
const void* open_own_module(const OwnModule& module);

/// The same; its table begins with a version. @throws Error also if that is another one
template <typename Table>
const Table& own_module_table(const OwnModule& module, int version);

/// @throws Error saying that the module is of another version
[[noreturn]] void refuse_module_version(const OwnModule& module);

template <typename Table>
const Table& own_module_table(const OwnModule& module, int version) {
  const auto* const table = static_cast<const Table*>(open_own_module(module));
  if (table->version != version) refuse_module_version(module);
  return *table;
}

}  // namespace touchstone
