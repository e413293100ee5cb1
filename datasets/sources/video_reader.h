#pragma once
// Internal to the video module.

#include <memory>
#include <string>

#include "datasets/sources/video_module.h"

namespace touchstone {

/// Frames of a video file, an address or a camera.
class VideoInput {
 public:
  VideoInput() = default;
  virtual ~VideoInput() = default;
  VideoInput(const VideoInput&) = delete;
  VideoInput& operator=(const VideoInput&) = delete;

  /// As TouchstoneVideoModule's read.
  virtual int read(TouchstoneVideoFrame& frame, std::string& message) = 0;
};

/// How long a source is waited for.
struct VideoPatience {
  double timeout_s;
  int (*gives_up)(void* context);
  void* context;

  bool ended() const { return gives_up != nullptr && gives_up(context) != 0; }
};

/// Null, and `message`, if it can't be opened.
std::unique_ptr<VideoInput> open_video(const std::string& place, bool address, const VideoPatience& patience,
                                       TouchstoneVideoInfo& info, std::string& message);
/// The same of a camera's number.
std::unique_ptr<VideoInput> open_camera(const std::string& number, const VideoPatience& patience,
                                        TouchstoneVideoInfo& info, std::string& message);

}  // namespace touchstone
