#pragma once
// What FFmpeg says of what goes wrong. Internal to the video module.

#include <string>

namespace touchstone {

/// While it lives, this thread's calls print nothing, and the last error that they'd print is kept.
class FfmpegListener {
 public:
  FfmpegListener();
  ~FfmpegListener();
  FfmpegListener(const FfmpegListener&) = delete;
  FfmpegListener& operator=(const FfmpegListener&) = delete;
};

/// The last error since this thread's listener began to live; "" if there was none.
const std::string& ffmpeg_said();

/// What was kept since the listener began to live, or without it FFmpeg's own words for the code.
std::string ffmpeg_words(int code);

}  // namespace touchstone
