#pragma once
// Moulded plastic with the grain of leather: flat pebbles between narrow valleys, and the fine dull finish of the
// mould.

#include <cstdint>

#include "core/yaml_reader.h"
#include "fem/shapes/relief_map.h"

namespace touchstone::sim {

/// A moulded grain.
struct PlasticRelief {
  static constexpr const char* kType = "plastic";
  static constexpr bool kSharp = false;

  double pebble_mm = 0.8;   ///< mean diameter of a pebble
  double spread = 0.2;      ///< relative standard deviation that is asked of their diameters
  double valley_mm = 0.2;   ///< width of the valleys
  double depth_um = 60.0;   ///< of the valleys below the pebbles
  double finish_um = 1.5;   ///< root mean square of the mould's etched finish
  double finish_mm = 0.08;  ///< its correlation length
  double size_mm = 16.0;    ///< period of the random surface
  std::uint64_t seed = 1;
};

void fields(YamlReader& in, PlasticRelief& relief);
/// One period, random by `seed`.
fem::ReliefMap relief_map(const PlasticRelief& relief);
/// The narrowest thing of it that a tile shows, mm: kTileDetail.
double finest_detail(const PlasticRelief& relief);

}  // namespace touchstone::sim
