#pragma once
// The folder of a data set while it's being made: what is in it, whose it is, and what of it can be kept.

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "datasets/sets/folder_lock.h"
#include "datasets/sets/manifest.h"
#include "datasets/sets/run_identity.h"
#include "datasets/sets/run_journal.h"

namespace touchstone::datasets {

/// Records of a run that isn't finished lie in this folder of the data set; it goes when the set is whole.
inline constexpr const char* kUnfinished = ".unfinished";

/// Has it a name that core/whole_file.h gives to files that aren't whole: .name.<16 hexadecimal digits>.part.ending?
bool is_temporary_file(const std::filesystem::path& file);

/// What is found at the place where a data set is wanted.
enum class FolderState {
  absent,      ///< nothing, or an empty folder
  unfinished,  ///< begun by an equal run
  finished,    ///< the same job's finished set
};

/// Looks without touching. @throws Error if what is there is something else: another job's set, or foreign files
FolderState state_of_folder(const std::filesystem::path& out, const RunIdentity& identity);

/// Records whose the folder is that many runs will write into, and makes it if needed.
/// @throws Error as state_of_folder, or if it can't be written
void begin_shared(const std::filesystem::path& out, const RunIdentity& identity);

/// Writes the manifest, dataset.json, once the files that it names are on the disk, so that it's true also after a loss
/// of power. @throws Error if that can't be done
void write_manifest(const std::filesystem::path& out, const std::string& text, std::span<const WrittenFile> files);

/// Removes temporary files that killed runs left, and the records: the set is whole. @throws Error if it can't
void finish_folder(const std::filesystem::path& out);

/// The right to write into the folder alone, held until the run ends. If it ends before anything worth keeping was
/// recorded, all that this object made is removed again.
class RunFolder {
 public:
  /// Makes the folder if needed, takes its lock, and records whose it is.
  /// @throws Error as state_of_folder, if another run holds it, or if it can't be written
  RunFolder(const std::filesystem::path& out, const RunIdentity& identity);
  ~RunFolder();
  RunFolder(const RunFolder&) = delete;
  RunFolder& operator=(const RunFolder&) = delete;

  /// Records of earlier runs whose files are all there, whole, sorted by sample.
  std::vector<FrameRecord> whole_records() const;
  /// The file of the records.
  std::filesystem::path journal() const;
  /// From now on what is in the folder is worth keeping.
  void keep();
  /// finish_folder().
  void finish();

 private:
  std::filesystem::path out_;
  std::filesystem::path remove_if_useless_;  // the topmost folder that was made, or empty
  bool keep_ = false;
  std::unique_ptr<FolderLock> lock_;
};

}  // namespace touchstone::datasets
