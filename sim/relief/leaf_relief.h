#pragma once

#include <Eigen/Core>
#include <string>

#include "core/yaml_reader.h"
#include "fem/shapes/relief_map.h"

namespace touchstone::sim {

/// The veins on a leaf's underside: a midrib along x through the origin, and side veins that leave it in pairs towards
/// +x. A vein's section is half a wave, (1 + cos) / 2 of its height; the midrib keeps its height, side veins thin out
/// in height from the midrib to the rim. Over a rectangle centred on the object's z axis; beyond it nothing is raised.
struct LeafRelief {
  static constexpr const char* kType = "leaf";
  static constexpr bool kSharp = true;

  Eigen::Vector2d size_mm = Eigen::Vector2d::Zero();  ///< the rectangle, x along the midrib
  double midrib_height_um = 0.0;
  double midrib_width_mm = 0.0;
  double vein_height_um = 0.0;  ///< of side veins, at the midrib
  double vein_width_mm = 0.0;
  double vein_pitch_mm = 0.0;    ///< from one pair to the next, along the midrib
  double vein_angle_deg = 50.0;  ///< between midrib and side veins
};

void fields(YamlReader& in, LeafRelief& leaf);

/// The narrowest vein's width, mm.
double finest_detail(const LeafRelief& leaf);
/// The leaf once, not repeated.
fem::ReliefMap relief_map(const LeafRelief& leaf);

}  // namespace touchstone::sim
