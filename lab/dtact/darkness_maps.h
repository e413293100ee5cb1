#pragma once
// Height maps on disk, from frames, of any source, of a gel that shows depth as darkness.

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "core/progress.h"
#include "lab/gelsight/height_maps.h"
#include "sensors/heights/darkness_estimator.h"

namespace touchstone::lab {

/// A line of the summary.
struct DarknessRecord {
  std::string file;
  double highest_mm = 0.0;
  double volume_mm3 = 0.0;  ///< sum of the heights times a pixel's area
  double contact_mm2 = 0.0;
  double exposure = 1.0;  ///< the frame's over the rest picture's
  bool exposure_followed = false;
  double deeper_percent = 0.0;  ///< of the pixels: sensors::kDeeper
  double bulged_percent = 0.0;  ///< sensors::kBulged
  double saturated_percent = 0.0;
  bool trusted = true;
  bool contact_at_border = false;
  std::string fault = {};  ///< as HeightRecord's
};

/// Shown each frame with its result; may be empty.
using ShownDarkness = std::function<void(const datasets::SourceFrame& frame, const sensors::DarknessResult& result)>;

/// Estimates each frame of each stream and writes FOLDER/STEM.exr or .png (of several streams FOLDER/SEQUENCE/STEM);
/// with `doubt` also STEM-doubt.png (bits of sensors::Doubt); and FOLDER/heights.csv when all are done. Folders are
/// made if they aren't there. A frame that can't be read or estimated has a record with its fault, and no map.
/// @throws Error if there is a fault in each of them
std::vector<DarknessRecord> write_darkness_maps(const sensors::DarknessModel& model,
                                                const std::vector<datasets::FrameStream>& streams,
                                                const std::filesystem::path& folder, HeightFormat format, bool doubt,
                                                const Progress& progress = {}, const ShownDarkness& show = {});

}  // namespace touchstone::lab
