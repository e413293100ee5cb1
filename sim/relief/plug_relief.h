#pragma once
// One wide face of a plug's sheet metal shell, as of a USB Standard-A plug: two windows for the socket's springs, the
// seam where the sheet's ends meet, rounded edges.

#include <Eigen/Core>

#include "core/yaml_reader.h"
#include "fem/shapes/relief_map.h"

namespace touchstone::sim {

/// Heights over the floor, which lies one sheet's thickness below the face. The face is centred on the object's z axis,
/// `width_mm` along x and `length_mm` along y; the plug's mouth is its edge at y = -length_mm / 2. The shape below must
/// be a box of that size.
struct PlugRelief {
  static constexpr const char* kType = "plug";
  static constexpr bool kSharp = false;
  double width_mm = 0.0, length_mm = 0.0;
  double sheet_um = 0.0;                                ///< its thickness: the windows' depth
  double edge_radius_mm = 0.0;                          ///< of the bends along both sides, and of the mouth's rounding
  Eigen::Vector2d window_mm = Eigen::Vector2d::Zero();  ///< across (x) and along (y) the plug
  double window_apart_mm = 0.0;                         ///< between the windows' middles
  double window_from_mouth_mm = 0.0;                    ///< from the mouth to the windows' nearer edges
  double seam_um = 0.0;                                 ///< width of the seam; 0: a face without one
};

/// Refuses windows that don't lie on the face side by side.
void fields(YamlReader& in, PlugRelief& relief);

/// The plug's face once, not repeated.
fem::ReliefMap relief_map(const PlugRelief& relief);

/// The smaller side of a window, mm: the seam is left for finer pixels to see.
double finest_detail(const PlugRelief& relief);

}  // namespace touchstone::sim
