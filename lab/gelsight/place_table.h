#pragma once
// Maps of an object's face, and the places of touches on them, from height maps on disk.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/progress.h"
#include "lab/gelsight/height_source.h"
#include "lab/gelsight/mark_table.h"
#include "sensors/touch_map/place_map.h"
#include "sensors/touch_map/tactile_map.h"

namespace touchstone::lab {

/// What came of one file.
struct PlaceRecord {
  std::string file;
  sensors::Registration found;
  std::string fault = {};  ///< why it couldn't be tried
};

/// Registers the source's height maps, in their order, with a map.
class PlaceReader {
 public:
  /// @param marks as of read_place_map; empty: pixels lie on a straight grid
  explicit PlaceReader(HeightSource& source, std::filesystem::path marks = {});

  /// A map of all touches that can be localised on those before them; the first one with contact becomes the root.
  /// @throws Error if none has contact, or no file can be used
  sensors::TactileMap build(const sensors::TactileMapSettings& settings, std::vector<PlaceRecord>& records,
                            const Progress& progress = {});

  /// The places of all touches on the map, which stays as it is. @throws Error if no file can be used
  std::vector<PlaceRecord> localise(const sensors::TactileMap& map, const Progress& progress = {});

 private:
  template <typename Register>
  std::vector<PlaceRecord> for_touches(const Register& with, const Progress& progress);
  sensors::TouchImage touch_of(const cv::Mat& heights) const;

  HeightSource& source_;
  std::filesystem::path marks_;
  std::optional<sensors::PlaceMap> places_;
};

/// A table, a line a file: `file,outcome,x_mm,y_mm,angle_deg,confidence,inliers,correlation,overlap,fault`.
std::string to_csv(const std::vector<PlaceRecord>& records);

}  // namespace touchstone::lab
