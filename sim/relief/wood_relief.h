#pragma once
// Planed wood, its grain along y: vessels cut open along their length, fibres, and the step from early to late wood.

#include <cstdint>

#include "core/yaml_reader.h"
#include "fem/shapes/relief_map.h"

namespace touchstone::sim {

/// A planed board.
struct WoodRelief {
  static constexpr const char* kType = "wood";
  static constexpr bool kSharp = false;

  double ring_mm = 2.0;           ///< a year's growth
  double ring_um = 15.0;          ///< how far late wood stands above early wood
  double vessels_per_mm2 = 1.0;   ///< mean; softwoods have none
  double ring_porosity = 0.8;     ///< 0: vessels everywhere alike; 1: in early wood only
  double vessel_um = 120.0;       ///< mean width of a cut vessel
  double vessel_length_mm = 2.0;  ///< mean length of its groove
  double vessel_depth_um = 60.0;  ///< mean depth of its groove
  double fibre_um = 4.0;          ///< root mean square of the fibres' ridges
  double fibre_mm = 0.06;         ///< their width
  double fibre_length_mm = 1.0;   ///< over which they keep their height
  double size_mm = 16.0;          ///< least period of the random surface
  std::uint64_t seed = 1;
};

void fields(YamlReader& in, WoodRelief& relief);
/// One period, random by `seed`.
fem::ReliefMap relief_map(const WoodRelief& relief);
/// The narrowest thing of it that a tile shows, mm: kTileDetail.
double finest_detail(const WoodRelief& relief);

}  // namespace touchstone::sim
