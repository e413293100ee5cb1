#pragma once
// Height maps to be read further (place, texture): estimated from frames of a coated gel, or as `touchstone estimate`
// left them on disk.

#include <filesystem>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "sensors/heights/height_estimator.h"

namespace touchstone::lab {

/// One folder's height maps. Not for several threads.
class HeightSource {
 public:
  /// Of frames, by a model; with free borders, since what is touched runs out of the picture. @throws Error as
  /// datasets::picture_files, or for a faulty model
  HeightSource(const sensors::HeightModel& model, const std::filesystem::path& frames);

  /// Of the EXR files of a folder, which have a channel `height_mm`; in natural order of their names.
  /// @throws Error if it's no folder or has no EXR file, or for a pixel of no size
  HeightSource(const std::filesystem::path& maps, double mm_per_px);

  /// A frame or a map each.
  const std::vector<std::filesystem::path>& files() const { return files_; }
  double mm_per_px() const { return mm_per_px_; }

  /// The heights of one of the files, or of another that lies elsewhere: CV_32FC1, mm, finite; good until the next
  /// call.
  /// @throws Error naming the file if it can't be read, isn't of the model's kind, isn't to be trusted (overexposed,
  /// dark, of one colour), or has no channel `height_mm`
  cv::Mat read(const std::filesystem::path& file);

 private:
  std::vector<std::filesystem::path> files_;
  double mm_per_px_ = 0.0;
  std::optional<sensors::HeightEstimator> estimator_;
};

}  // namespace touchstone::lab
