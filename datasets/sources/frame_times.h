#pragma once
// When the frames of a source were taken, where the source itself doesn't say or isn't to be believed.

#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "datasets/sources/frame_source.h"

namespace touchstone::datasets {

/// A table of times: CSV with the header `file,t_us`, `file,t_s`, `frame,t_us` or `frame,t_s`; a line a frame, later
/// from line to line.
struct FrameTimes {
  std::filesystem::path csv;
  bool by_file = false;
  std::map<std::string, std::pair<std::int64_t, int>> of_file;    ///< t_us and line
  std::map<std::int64_t, std::pair<std::int64_t, int>> of_frame;  ///< likewise, by number from 0
};

/// @throws Error with file and line for another header, a cell that isn't what its column says, a frame that comes
/// twice, or a time that isn't later than the one before
FrameTimes read_frame_times(const std::filesystem::path& csv);

/// The stream with the table's times. A frame without a line is a fault, as is a line without a frame at the end.
/// @throws Error for a table of files
FrameStream with_times(FrameStream stream, const FrameTimes& times);
/// The same of pictures, all of which are known. @throws Error naming the line whose picture isn't there or is no later
/// than the one before it in natural order, or the picture that has no line
FrameSequence with_times(FrameSequence sequence, const FrameTimes& times);

/// Frames at a constant rate. @throws Error unless it is above 0 and finite
FrameStream with_rate(FrameStream stream, double rate_Hz);

/// Only the frames that a table has forces of, with its times. A line without a frame is a fault at the end.
FrameStream with_forces(FrameStream stream, std::vector<NumberedForce> forces, const std::filesystem::path& csv);

/// The frames up to a number of them (0: any), or up to a time after the first one (0: any), or until `stopped`.
FrameStream limited(FrameStream stream, std::int64_t most_frames, double most_s, std::function<bool()> stopped);

}  // namespace touchstone::datasets
