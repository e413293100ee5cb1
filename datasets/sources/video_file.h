#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>

namespace touchstone::datasets {

/// Pictures as a video for people: MP4, lossy. The file is there whole or not at all.
///
/// It's shown at the pictures' own times. Where the first ones are usually less than 1/60 s apart, which no screen
/// shows, it's slowed down so that these are 1/25 s apart; without times all are.
class VideoFile {
 public:
  /// @throws Error unless the name ends in .mp4 and can be written
  explicit VideoFile(const std::filesystem::path& file);
  /// Without finish() there is no file.
  ~VideoFile();
  VideoFile(const VideoFile&) = delete;
  VideoFile& operator=(const VideoFile&) = delete;

  /// @param picture 8 bit BGR, at least 2 x 2; of another size than the first it's scaled to that
  /// @param t_us when it was taken, by its sequence's clock; one that goes back begins another sequence
  /// @throws Error naming the file
  void add(const cv::Mat& picture, std::optional<std::int64_t> t_us);
  /// Gives the file its name; without pictures there is none. @throws Error naming the file @pre once, at the end
  void finish();
  /// How often slower than life it's shown; 1 where it isn't.
  double slowed() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// @throws Error unless a video's name has an ending that VideoFile writes
void require_video_name(const std::filesystem::path& file);

}  // namespace touchstone::datasets
