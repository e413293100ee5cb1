#pragma once

#include <filesystem>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>

#include "apps/estimators/picture_options.h"
#include "apps/live_view.h"
#include "datasets/sources/frame_source.h"
#include "datasets/sources/video_file.h"

namespace touchstone::apps {

/// Where the pictures of an estimate go: to files, to a video, to a live view; to some of them or to none.
class OverlaySink {
 public:
  /// @param folder of the pictures, made at the first one; empty: none are kept @param title of the live view, whose
  /// address is printed @throws Error if the video can't be written or the port can't be had
  OverlaySink(const PictureOptions& options, std::filesystem::path folder, const std::string& title);

  bool wanted() const { return view_ != nullptr || video_ != nullptr || !folder_.empty(); }
  /// Takes a frame's picture.
  void take(const datasets::SourceFrame& frame, const cv::Mat& picture);
  /// All frames come once more: a video has only the second pictures.
  void begin_again();
  /// Gives the video its name, and says so. @pre once, at the end
  void finish();

 private:
  PictureOptions options_;
  std::filesystem::path folder_;
  std::unique_ptr<LiveView> view_;
  std::unique_ptr<datasets::VideoFile> video_;
};

}  // namespace touchstone::apps
