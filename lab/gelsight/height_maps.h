#pragma once
// Height maps on disk, from frames of any source.

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "core/progress.h"
#include "datasets/inspection/on_picture.h"
#include "datasets/sources/frame_source.h"
#include "sensors/heights/height_estimator.h"

namespace touchstone::lab {

/// The height that is white in pictures of heights.
inline constexpr double kWhite_mm = 1.0;

/// How a height map is stored.
enum class HeightFormat {
  exr,   ///< one float channel, `height_mm`
  png16  ///< 16 bit grey: level 10000 is 0 mm, a level is 0.1 um: -1 to 5.55 mm
};

/// Writes a height map (CV_32FC1, mm) beside `file`: the same name with .exr or .png. Makes its folder if need be.
void write_height_map(const cv::Mat& height_mm, std::filesystem::path file, HeightFormat format);

/// A line of the summary.
struct HeightRecord {
  std::string file;
  double highest_mm = 0.0;
  double volume_mm3 = 0.0;  ///< sum of the heights times a pixel's area
  double contact_mm2 = 0.0;
  double saturated_percent = 0.0;
  bool trusted = true;
  bool contact_at_border = false;
  std::string fault = {};  ///< why there is no map of it: it can't be read or isn't of the model's kind; "": there is
};

/// The faults of records. @throws Error if no frame could be used
template <typename Record>
std::vector<std::string> faults_of(const std::vector<Record>& records) {
  std::vector<std::string> faults;
  for (const Record& record : records) {
    if (!record.fault.empty()) faults.push_back(record.fault);
  }
  datasets::require_a_frame(faults, records.size());
  return faults;
}

/// Estimates each frame of each stream and writes FOLDER/STEM.exr or .png (of several streams FOLDER/SEQUENCE/STEM),
/// and FOLDER/heights.csv when all are done. Folders are made if they aren't there. A frame that can't be read or
/// estimated has a record with its fault, and no map.
/// @param show shown each frame with its result; may be empty
/// @throws Error if there is a fault in each of them
std::vector<HeightRecord> write_height_maps(
    const sensors::HeightModel& model, const sensors::HeightSettings& settings,
    const std::vector<datasets::FrameStream>& streams, const std::filesystem::path& folder, HeightFormat format,
    const Progress& progress = {},
    const std::function<void(const datasets::SourceFrame& frame, const sensors::HeightResult& result)>& show = {});

}  // namespace touchstone::lab
