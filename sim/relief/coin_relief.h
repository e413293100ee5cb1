#pragma once
// The relief of a coin that nobody minted: rim, a ring of beads, glyph-like strokes along an arc, a head-like blob with
// strands, all drawn from a seed.

#include <cstdint>

#include "core/yaml_reader.h"
#include "fem/shapes/relief_map.h"

namespace touchstone::sim {

/// Heights over the field, which is the floor. The coin lies centred on the object's z axis, the head's middle at the
/// origin.
struct CoinRelief {
  static constexpr const char* kType = "coin";
  static constexpr bool kSharp = false;
  double diameter_mm = 0.0;
  double rim_um = 0.0;  ///< height of the rim
  double art_um = 0.0;  ///< of the highest point of all within the rim
  std::int64_t seed = 0;
};

void fields(YamlReader& in, CoinRelief& relief);

/// The coin's face once, not repeated.
fem::ReliefMap relief_map(const CoinRelief& relief);

/// Width of a glyph's stroke, mm.
double finest_detail(const CoinRelief& relief);

}  // namespace touchstone::sim
