#pragma once
// Height maps to be read further (place, texture): estimated from frames of a coated gel, or as `touchstone estimate`
// left them on disk.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "datasets/sources/frame_source.h"
#include "datasets/sources/table_frames.h"
#include "sensors/heights/height_estimator.h"

namespace touchstone::lab {

/// One height map of a source, or why there is none.
struct SourceHeights {
  std::string file;   ///< as tables call it
  std::string title;  ///< in messages
  cv::Mat height_mm;  ///< CV_32FC1, finite; good until the next one
  std::string fault = {};
};

/// Height maps one after the other, and those of single files. Not for several threads.
class HeightSource {
 public:
  /// Of frames, by a model; with free borders, since what is touched runs out of the picture. @throws Error for a
  /// faulty model
  HeightSource(const sensors::HeightModel& model, std::vector<datasets::FrameStream> streams);

  /// Of the EXR files of a folder, which have a channel `height_mm`; in natural order of their names.
  /// @throws Error if it's no folder or has no EXR file, or for a pixel of no size
  HeightSource(const std::filesystem::path& maps, double mm_per_px);

  double mm_per_px() const { return mm_per_px_; }
  /// How many there are; 0 if that isn't known.
  std::int64_t maps() const;
  /// The next map; false at the end. @throws Error as FrameSource::next
  bool next(SourceHeights& map);

  /// The heights of a frame that a table names, or of a file of heights: CV_32FC1, mm, finite; good until the next
  /// call.
  /// @throws Error naming the file if it can't be read, isn't of the model's kind, isn't to be trusted (overexposed,
  /// dark, of one colour), or has no channel `height_mm`
  cv::Mat read(datasets::TableFrames& frames, const std::filesystem::path& file);

 private:
  cv::Mat estimated(const cv::Mat& frame);
  cv::Mat checked(const std::filesystem::path& file, const std::function<cv::Mat()>& heights) const;

  std::vector<std::filesystem::path> files_;
  std::vector<datasets::FrameStream> streams_;
  std::size_t next_ = 0;  ///< file or stream
  std::unique_ptr<datasets::FrameSource> open_;
  double mm_per_px_ = 0.0;
  std::optional<sensors::HeightEstimator> estimator_;
};

}  // namespace touchstone::lab
