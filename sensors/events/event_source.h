#pragma once
// What a file of events says of itself, and how it is to be read.

#include <cstddef>
#include <cstdint>
#include <opencv2/core/types.hpp>
#include <optional>

namespace touchstone::sensors {

/// Kinds of files that hold events; docs/file-formats.md has each one's layout.
enum class EventFormat {
  text,    ///< a line an event
  dsec,    ///< HDF5 in the layout of the DSEC data set
  evt3,    ///< Prophesee RAW, EVT 3.0
  aedat4,  ///< iniVation AEDAT 4.0
};

/// What the file doesn't say.
struct EventReadOptions {
  /// The camera's, pixels: what lies beside it is an error. Must agree with the file's own where it has one.
  std::optional<cv::Size> size;
  /// Number of the stream to read of an AEDAT 4.0 file that has events of several cameras or filters.
  std::optional<int> stream;
};

/// What is known of a file while it's read. Counts are of what was passed so far.
struct EventSource {
  EventFormat format = EventFormat::text;
  std::optional<cv::Size> size;  ///< of the camera, pixels, where the file or the options say it
  std::int64_t events = 0;       ///< handed out
  std::int64_t triggers = 0;     ///< left out: edges of external triggers (AEDAT4: packets of them)
  std::int64_t unplaced = 0;     ///< left out: events before the stream's first full time and row (EVT3)
  std::int64_t others = 0;       ///< left out: words of the maker's own (EVT3), packets of other streams (AEDAT4)
};

/// About as many events make a portion.
constexpr std::size_t kEventPortion = 65536;

}  // namespace touchstone::sensors
