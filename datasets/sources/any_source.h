#pragma once
// One text for all that frames may come from, as a command's argument.

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "datasets/sources/frame_source.h"

namespace touchstone::datasets {

/// What is known of a source besides its place.
struct SourceChoice {
  std::string place;                   ///< below
  std::optional<Split> split = {};     ///< of a data set; none: all of it
  bool split_given = false;            ///< it was asked for, so the source must be a data set
  std::filesystem::path times = {};    ///< a table of times (datasets/sources/frame_times.h), or empty
  std::filesystem::path forces = {};   ///< a table of forces with times, or empty
  double rate_Hz = 0.0;                ///< of the frames; 0: not given
  std::int64_t most_frames = 0;        ///< of each sequence; 0: all
  double most_s = 0.0;                 ///< likewise, from its first frame on
  double timeout_s = 10.0;             ///< of a live source
  std::function<bool()> stopped = {};  ///< asked between frames of a live source: true ends it
};

/// The sequences of a source. `place` is one of
/// - a folder of pictures (picture_files) or one picture;
/// - a folder with a data set of scenes or one that was drawn;
/// - a video file;
/// - a camera's number, or its device (/dev/video0);
/// - an address (http://, https://, rtsp://), as `touchstone serve` has one.
/// Times are those of the tables, of the rate, or else the source's own, if it has any.
/// @throws Error naming the place, what is wrong with it and what is allowed, or options that don't fit it
std::vector<FrameStream> streams_of(const SourceChoice& choice);

/// Is it a source without an end? @throws Error for an address of a kind that isn't read
bool is_live(const std::string& place);

/// For the help of commands: what a source may be.
inline constexpr const char* kSourceHelp =
    "Frames: a folder of pictures in natural order of their names, a video file, a data set that `touchstone generate` "
    "made, a camera's number, or an address (http://, rtsp://), such as that of `touchstone serve`";

}  // namespace touchstone::datasets
