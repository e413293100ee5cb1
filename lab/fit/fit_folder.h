#pragma once
// The folder of a fit: whose it is, and what of a fit that was broken off is kept in it.

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "datasets/sets/folder_lock.h"
#include "datasets/sets/run_identity.h"
#include "lab/fit/fit_so_far.h"
#include "lab/fit/unit_fit_spec.h"

namespace touchstone::lab {

/// What a fit's result depends on: its file, all files that this names, and the pictures of its recording.
datasets::RunIdentity identity_of_fit(const std::filesystem::path& file, const std::optional<RecordingSpec>& recording);

/// The right to write a fit into a folder, held while it lives. `.unfinished/NAME.bin` is what was kept so far, whole;
/// it goes with the end of the fit. A folder that was made and holds nothing in the end goes, too.
class FitFolder {
 public:
  /// Makes the folder if needed. @throws Error if it can't be made or another run holds it, or if it holds a fit of
  /// this name, finished or not, that was made of something else, which the message names
  FitFolder(std::filesystem::path folder, std::string name, datasets::RunIdentity identity);
  ~FitFolder();
  FitFolder(const FitFolder&) = delete;
  FitFolder& operator=(const FitFolder&) = delete;

  bool is_finished() const { return lock_ == nullptr; }
  const datasets::RunIdentity& identity() const { return identity_; }
  /// `ending` with its dot. @returns FOLDER/NAMEending
  std::filesystem::path file(const std::string& ending) const { return folder_ / (name_ + ending); }
  /// What an earlier run has kept. @throws Error if it's damaged
  std::optional<FitSoFar> so_far() const;
  /// @throws Error if it can't be written
  void keep(const FitSoFar& so_far) const;
  /// The results are there: what was kept isn't needed any more.
  void finish();

 private:
  std::filesystem::path kept() const { return folder_ / ".unfinished" / (name_ + ".bin"); }

  std::filesystem::path folder_;
  std::string name_;
  datasets::RunIdentity identity_;
  bool made_ = false;  // by this run
  std::unique_ptr<datasets::FolderLock> lock_;
};

}  // namespace touchstone::lab
