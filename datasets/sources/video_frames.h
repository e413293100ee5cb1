#pragma once
// Frames of videos, cameras and addresses as streams (datasets/sources/video_module.h). FFmpeg and OpenCV's videoio are
// loaded with the first of them.

#include <functional>
#include <string>

#include "datasets/sources/frame_source.h"

namespace touchstone::datasets {

/// How a live source is waited for.
struct LivePatience {
  double timeout_s = 10.0;             ///< until it must be open, and until its next frame must be there
  std::function<bool()> stopped = {};  ///< asked while it is waited for: true ends the source
};

/// A video file. Frames have the file's own times, from its beginning; damaged ones are faults, those that are drawn
/// over a damaged one, too; if the file ends too early, the last one says so. They are turned as a player turns them.
/// @throws Error if it's no file, or no video that can be read
FrameStream video_stream(const std::string& file);

/// A camera of this machine by its number. It's opened by a thread of its own; if that fails the first frame says so.
/// Frames have times from the first one on, by this machine's clock. A frame is left out if estimates are too slow for
/// it: the numbers of frames count on.
/// @throws Error if there's no such camera
FrameStream camera_stream(int number, const LivePatience& patience);

/// The same of an address: http, https, rtsp.
FrameStream address_stream(const std::string& address, const LivePatience& patience);

/// Is it an address that is read here? @throws Error for an address of another kind
bool is_address(const std::string& place);

}  // namespace touchstone::datasets
