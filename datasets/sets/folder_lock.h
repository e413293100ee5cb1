#pragma once

#include <filesystem>

namespace touchstone::datasets {

/// Keeps a second run out of a folder as long as it lives: a lock on a file in it (flock), which the system drops when
/// the process ends, however it ends. Machines that share a folder without shared locks aren't kept apart.
class FolderLock {
 public:
  /// Takes the lock or doesn't wait. `file` is made if it isn't there, and says who holds the lock.
  /// @throws Error that names the holder if there is one, or if the file can't be made
  explicit FolderLock(const std::filesystem::path& file);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int descriptor_ = -1;
};

}  // namespace touchstone::datasets
