#pragma once
// What one picture shows of a grid of coloured markers behind coloured filters [Lin2019]: each soft marker is seen
// through a rigid filter square of its own, so a region of the picture shows filter, marker and both in a mix.
//
// Markers are numbered row by row: y grows from row to row, as down the upright picture, and x along a row.

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "sensors/image/frame_light.h"

namespace touchstone::sensors {

/// Why a marker's figures can't be used.
enum class MarkerFlaw : std::uint8_t {
  kNone,
  kMissing,       ///< no coloured region where the grid has one, or one without ink, or without its filter
  kTwoFilters,    ///< its ink shows under a neighbour's filter, or runs into a neighbour's region
  kOverexposed,   ///< too much of it has a channel at full scale: hue can't be measured
  kUnderexposed,  ///< too dark for a hue
  kColourless,    ///< too few of its pixels are saturated in colour
  kCutOff,        ///< the picture's edge goes through it
};

/// "none", "missing", "two_filters", ...
const char* name_of(MarkerFlaw flaw);

/// What the direct neighbours of a marker in the grid have done since the picture at rest: those that are sound in
/// both.
struct MarkerSurroundings {
  bool known = false;          ///< there's such a neighbour along the grid's rows and one along its columns
  double log_cell_area = 0.0;  ///< logarithm of the growth of a cell of the grid, as their ink's centroids span it
  double log_ink_area = 0.0;   ///< mean logarithm of the growth of their ink's areas
};

/// One marker with its filter. Positions in px, pixel centres at + 0.5 (core/transform.h); areas in px^2, the rims'
/// pixels counted by what is covered of them.
struct ColourMarker {
  MarkerFlaw flaw = MarkerFlaw::kMissing;                     ///< but for kNone all else is undefined
  double hue = 0.0;                                           ///< circular mean over the pixels of more than half
                                                              ///< saturation, radians in [0, 2 pi): 0 is red
  Eigen::Vector2d centroid_px = Eigen::Vector2d::Zero();      ///< of all that is coloured, filter or ink
  Eigen::Vector2d ink_centroid_px = Eigen::Vector2d::Zero();  ///< of what has the soft marker's ink
  double coloured_area_px = 0.0;
  double ink_area_px = 0.0;
  MarkerSurroundings surroundings;
};

/// A whole picture. Where `light` isn't normal every marker is flawed.
struct ColourMarkerReading {
  FrameLight light = FrameLight::kNormal;
  Eigen::Vector2i grid = Eigen::Vector2i::Zero();  ///< columns, rows
  std::vector<ColourMarker> markers;               ///< columns * rows
};

}  // namespace touchstone::sensors
