#pragma once
// What a run that isn't finished has done so far, kept so that the next one can go on from there.

#include <cstdint>
#include <filesystem>
#include <mutex>
#include <string>
#include <vector>

namespace touchstone::datasets {

/// A file of a data set.
struct WrittenFile {
  std::string name;  ///< relative to the data set's folder, with forward slashes
  std::string sha256;
  std::int64_t bytes = 0;
};

/// The pictures of one sample, and what they cost.
struct FrameRecord {
  std::int64_t sample = 0;
  std::vector<WrittenFile> files;
  std::int64_t pixels_traced = 0;
  std::int64_t paths_traced = 0;
  std::string light;  ///< sim::Capture::light
};

/// The records of a journal; none if there is no such file. Lines that are broken off or aren't records are passed
/// over: their frames are made again.
std::vector<FrameRecord> read_journal(const std::filesystem::path& file);

/// A journal that grows by one line a finished frame. A line is written by one call, so that a kill can only break
/// off the last one. `append` may be called from several threads at once.
class RunJournal {
 public:
  /// Starts the journal anew with the records that are kept from before.
  RunJournal(const std::filesystem::path& file, const std::vector<FrameRecord>& kept);
  ~RunJournal();
  RunJournal(const RunJournal&) = delete;
  RunJournal& operator=(const RunJournal&) = delete;

  /// @throws Error if it can't be written
  void append(const FrameRecord& record);

 private:
  std::string name_;
  int descriptor_ = -1;
  std::mutex mutex_;
};

}  // namespace touchstone::datasets
