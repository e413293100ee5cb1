#pragma once
// The tactile map of one face of an object, made touch by touch, and the pose of a touch on it [Li2015, sec. 3.3].
//
// Map frame: the touch frame of the first touch, the root (sensors/touch_map/touch_image.h). A touch's pose is
// `map_from_touch`: it takes points of the touch frame to points of the map.

#include <optional>
#include <vector>

#include "sensors/touch_map/height_registration.h"
#include "sensors/touch_map/touch_image.h"

namespace touchstone::sensors {

/// How touches are registered and joined.
struct TactileMapSettings {
  RegistrationSettings registration;
  /// Over which a touch's share in the average grows from its border inwards: no seams. 0: the thesis's plain average.
  double blend_mm = 0.5;
  /// Ours: a touch is raised or lowered as a whole to the map's heights where they overlap, since no two presses are
  /// equally deep. Off: heights as they come, as in the thesis.
  bool level = true;
};

/// Heights of the map as they are stored.
struct TactileMapData {
  cv::Mat height_mm;  ///< CV_32FC1, weighted means; 0 where never touched
  cv::Mat weight;     ///< CV_32FC1, summed weights; 0 where never touched
  PixelFrame frame;   ///< of the map; its origin on whole or half pixels
  int touches = 0;
};

/// A map that grows by touches. One object is for one thread.
class TactileMap {
 public:
  /// An empty map. @throws Error for settings out of range
  explicit TactileMap(const TactileMapSettings& settings = {});
  /// A map made before. @throws Error as `check` does
  TactileMap(TactileMapData data, const TactileMapSettings& settings = {});

  bool empty() const { return data_.touches == 0; }
  const TactileMapData& data() const { return data_; }
  /// The map as it is registered with; empty before the first touch.
  const DescribedSurface& surface() const { return surface_; }

  /// Adds a touch if it is localised; the first one becomes the root, if there is contact. What is new is placed, what
  /// is known averaged. @throws Error for a bad touch, another pitch, or a map grown beyond kMostPixelsASide
  Registration add(const TouchImage& touch);

  /// `to_from_from` is map_from_touch. @throws Error for a bad touch, another pitch or an empty map
  Registration localise(const TouchImage& touch) const;

  static constexpr int kMostPixelsASide = 8192;

 private:
  void place(const TouchImage& touch, const PlanarPose& map_from_touch);
  void describe();
  DescribedSurface described(const TouchImage& touch) const;

  TactileMapSettings settings_;
  HeightFeatureDetector detector_;
  TactileMapData data_;
  DescribedSurface surface_;
};

/// @throws Error naming what is wrong with the data: sizes, types, numbers that aren't finite, weights below 0
void check(const TactileMapData& data);

}  // namespace touchstone::sensors
