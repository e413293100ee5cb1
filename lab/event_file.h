#pragma once
// events/<scene>.h5: what event pixels told. See docs/file-formats.md for its arrays.

#include <filesystem>
#include <memory>
#include <opencv2/core/types.hpp>
#include <span>
#include <string>
#include <vector>

#include "core/frame.h"

namespace touchstone::lab {

/// Writes events as they come. The same events in the same portions give the same bytes.
class EventFileWriter {
 public:
  /// @param size of the camera, pixels
  /// @throws Error if the file can't be made
  EventFileWriter(const std::filesystem::path& file, cv::Size size, const std::string& program_version);
  ~EventFileWriter();
  EventFileWriter(const EventFileWriter&) = delete;
  EventFileWriter& operator=(const EventFileWriter&) = delete;

  /// @pre in the order of time
  void append(std::span<const Event> events);
  /// Ends the file; without this call there is none.
  void close();

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// A file of events, read whole.
struct EventFile {
  cv::Size size;
  std::vector<Event> events;
};

/// @throws Error if the file isn't one of events, or is broken
EventFile read_event_file(const std::filesystem::path& file);

}  // namespace touchstone::lab
