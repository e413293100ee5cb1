#pragma once
// Files of events, a real camera's or a simulated one's: text, HDF5 in the DSEC layout, Prophesee EVT 3.0 and iniVation
// AEDAT 4.0 (docs/file-formats.md).

#include <filesystem>
#include <memory>
#include <opencv2/core/types.hpp>
#include <span>
#include <string>
#include <vector>

#include "core/frame.h"
#include "sensors/events/event_source.h"

namespace touchstone::sensors {

/// The format that a file's name asks for: .txt or .csv, .h5 or .hdf5, .raw, .aedat4.
/// @throws Error for other endings
EventFormat event_format_of_name(const std::filesystem::path& file);

/// Reads a file's events in portions, so that a file of any length takes the same memory. The kind of file is
/// recognised by its first bytes, and by its name only if they don't. Times are those of the file's own clock, us, and
/// never go backwards. Each event is within the camera's pixels. Not for use from several threads at once; HDF5 files
/// not even by several readers at once.
class EventReader {
 public:
  /// @throws Error naming the file: it isn't there, is empty, isn't a file of events, is of a kind or version that
  /// isn't read, or its beginning is damaged
  explicit EventReader(const std::filesystem::path& file, const EventReadOptions& options = {});
  ~EventReader();
  EventReader(const EventReader&) = delete;
  EventReader& operator=(const EventReader&) = delete;

  /// The next portion, good until the next call; empty at the end of the file.
  /// @throws Error naming file, place, value and what is allowed where the file is damaged, an event is beside the
  ///   picture or earlier than the one before it
  std::span<const Event> next();
  /// What the file says of its camera.
  const EventSource& source() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// A file of events, read whole.
struct EventRecording {
  EventSource source;
  std::vector<Event> events;
};

/// @throws Error as EventReader
EventRecording read_events(const std::filesystem::path& file, const EventReadOptions& options = {});

/// Writes events as they come, in the format of the file's name. The same events give the same bytes for any portions.
/// All but HDF5 goes to the file at once; HDF5 is kept in memory, packed, until close(). For a file that is there whole
/// or not at all use it within write_whole_file.
class EventWriter {
 public:
  /// @param size of the camera, pixels
  /// @param program what wrote it: "touchstone 0.1.0"
  /// @throws Error if the file can't be made, or the format can't hold a camera of this size
  EventWriter(const std::filesystem::path& file, cv::Size size, const std::string& program);
  ~EventWriter();
  EventWriter(const EventWriter&) = delete;
  EventWriter& operator=(const EventWriter&) = delete;

  /// @throws Error if an event is beside the picture or earlier than the one before it
  void append(std::span<const Event> events);
  /// Ends the file; without this call there is none, or a broken one. @throws Error if not all of it could be written
  void close();

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace touchstone::sensors
