#pragma once
// Frames one after the other, wherever they come from: pictures, videos, cameras, data sets. An estimator sees no
// difference.

#include <cstdint>
#include <functional>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/error.h"
#include "datasets/sources/frame_sequence.h"

namespace touchstone::datasets {

/// A frame of a source, or why there is none.
struct SourceFrame {
  LabelledFrame label;
  std::string stem;   ///< of files that are made of it: "12", "clip-000012"; with a folder where there are several
                      ///< sequences: "press-1/000012"
  std::string title;  ///< in messages: "frames/12.png", "clip.avi: frame 12"
  cv::Mat image;      ///< 8 or 16 bit, grey or BGR; its own memory
  std::string fault;  ///< with the title; not empty: it can't be read, and there is no image
};

/// The frames of one sequence, in the order of time. Not for several threads.
class FrameSource {
 public:
  FrameSource() = default;
  virtual ~FrameSource() = default;
  FrameSource(const FrameSource&) = delete;
  FrameSource& operator=(const FrameSource&) = delete;

  /// Gives the next frame; false at the end. What is wrong with one frame is its fault and ends nothing.
  /// @throws Error if a live source can't be opened
  virtual bool next(SourceFrame& frame) = 0;
};

/// A sequence of frames that can be opened; of what is recorded as often as is wanted.
struct FrameStream {
  std::string name;
  std::optional<std::int64_t> frames = {};  ///< how many, where that is known beforehand
  bool live = false;                        ///< a camera's or an address': no frame comes twice
  std::function<std::unique_ptr<FrameSource>()> open;
  std::function<cv::Mat()> rest = {};  ///< the picture at rest, where it isn't among the frames
};

/// What is wrong with a frame: its own fault, or what `act(image)` throws as Error, naming it; "" if nothing is.
template <typename Act>
std::string fault_on_frame(const SourceFrame& frame, const Act& act) {
  if (!frame.fault.empty()) return frame.fault;
  try {
    act(frame.image);
  } catch (const Error& error) {
    const std::string message = error.what();
    return message.find(frame.title) != std::string::npos ? message : frame.title + ": " + message;
  }
  return "";
}

/// Calls `act(frame)` for each frame of each stream, one stream after the other.
template <typename Act>
void for_each_frame(const std::vector<FrameStream>& streams, const Act& act) {
  for (const FrameStream& stream : streams) {
    const std::unique_ptr<FrameSource> source = stream.open();
    for (SourceFrame frame; source->next(frame);) act(frame);
  }
}

/// What a table of frames calls one of them: the file's name, with its sequence before it where there are several.
std::string name_in_table(const SourceFrame& frame);

/// The first frame of a source. @throws Error if it has none, or its fault
SourceFrame first_frame(FrameSource& source, const std::string& name);

/// How many frames there are in all sequences; 0 if that isn't known of each.
std::int64_t frames_of(const std::vector<FrameStream>& streams);

/// Pictures on disk as a stream. @param folder of the stems: empty unless there are several sequences
FrameStream picture_stream(FrameSequence sequence, const std::string& folder = "");
/// Several of them, each with its name as the stems' folder.
std::vector<FrameStream> picture_streams(std::vector<FrameSequence> sequences);

}  // namespace touchstone::datasets
