#pragma once
// Videos for tests, written by FFmpeg's own encoders with times and turns that OpenCV's writer can't give.

#include <cstdint>
#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

namespace touchstone::test {

/// How a video is written.
struct VideoToWrite {
  std::string codec = "ffv1";           ///< FFmpeg's name
  std::string pixels = "bgr0";          ///< likewise: "gray", "gray16le", "yuv420p"
  std::vector<std::int64_t> t_ms = {};  ///< of each frame; empty: 40 ms apart
  int turned_deg = 0;                   ///< that players are to turn it clockwise
  int key_every = 12;                   ///< frames
};

/// Writes frames, grey or BGR of 8 bit or grey of 16 bit, in the container of the file's name. @throws Error
void write_video(const std::filesystem::path& file, const std::vector<cv::Mat>& frames, const VideoToWrite& how = {});

}  // namespace touchstone::test
