#pragma once
// Events as HDF5 in the layout of the DSEC data set [Gehrig2021].

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "core/frame.h"
#include "core/hdf5_file.h"
#include "sensors/events/event_check.h"
#include "sensors/events/event_source.h"

namespace touchstone::sensors {

/// Reads events/p, x, y, t of whole numbers of any size, and t_offset, which is added to all times (0 if there's none).
/// ms_to_idx isn't needed. The camera's size is in the attributes `width` and `height` of files of ours only.
class DsecEventReader {
 public:
  /// Opens the file. @throws Error as EventReader
  DsecEventReader(const std::filesystem::path& file, const EventReadOptions& options);

  /// Puts the next portion into `events`, nothing at the end.
  void read(std::vector<Event>& events);
  const EventSource& source() const { return source_; }

 private:
  std::string name_;
  Hdf5Reader file_;
  EventSource source_;
  EventCheck check_;
  std::int64_t count_ = 0;
  std::int64_t offset_us_ = 0;
  std::vector<std::int64_t> t_us_;
  std::vector<std::int32_t> x_, y_, polarity_;
};

/// Writes the layout with its own types (p uint8, x and y uint16, t uint32, ms_to_idx uint64, t_offset int64), packed
/// by HDF5's own deflate. t_offset is 0 if the first event comes within the 71.6 minutes that 32 bits of us hold, else
/// the whole millisecond before the first event.
class DsecEventWriter {
 public:
  /// Begins the file. @throws Error if it can't be written
  DsecEventWriter(const std::filesystem::path& file, cv::Size size, const std::string& program);
  /// @pre within the picture, in the order of time
  void append(std::span<const Event> events);
  /// Writes what is left, and ms_to_idx. @throws Error if the file can't be written
  void close();

 private:
  std::string name_;
  Hdf5Writer file_;
  std::uint64_t count_ = 0;
  std::int64_t offset_us_ = 0;
  std::vector<std::uint64_t> first_of_ms_;
  std::vector<std::uint32_t> t_us_;
  std::vector<std::uint16_t> x_, y_;
  std::vector<std::uint8_t> on_;
};

}  // namespace touchstone::sensors
