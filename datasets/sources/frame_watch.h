#pragma once
// Frames that a recorder or a connection has doubled or dropped.

#include <memory>
#include <string>
#include <vector>

#include "datasets/sources/frame_source.h"

namespace touchstone::datasets {

/// What was noticed of a source's frames, each once, in their order.
struct FrameNotes {
  std::vector<std::string> doubled;  ///< titles of frames that show the very picture of the one before, bit by bit
  std::vector<std::string> gaps;     ///< "clip.avi: frame 40: about 3 frames are missing before it"
};

/// The stream, whose frames are looked at as they pass: pictures beside the one before, times beside the usual interval
/// (the median of the last 15; from five on): one of more than 1.6 of it is a gap. The frames are as they were.
/// @pre notes isn't null, and outlives what is opened
FrameStream watched(FrameStream stream, std::shared_ptr<FrameNotes> notes);

}  // namespace touchstone::datasets
