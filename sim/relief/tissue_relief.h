#pragma once
// Tissue paper: soft fibres laid at random, the fine folds that creping leaves, and an embossed pattern.

#include <cstdint>

#include "core/yaml_reader.h"
#include "fem/shapes/relief_map.h"

namespace touchstone::sim {

/// The pattern pressed into the sheet.
enum class Embossing {
  none,
  dots,     ///< round knobs in a hexagonal pattern
  lozenges  ///< raised lines that cross
};
EnumNames<Embossing> enum_names(Embossing);

/// A sheet of tissue.
struct TissueRelief {
  static constexpr const char* kType = "tissue";
  static constexpr bool kSharp = false;

  Embossing embossing = Embossing::none;
  double emboss_mm = 2.0;         ///< from knob to knob, or from line to line
  double emboss_width_mm = 0.6;   ///< of a knob or line
  double emboss_um = 150.0;       ///< their height
  double crepe_mm = 0.3;          ///< mean distance of the folds, which run along x
  double crepe_um = 20.0;         ///< their root mean square
  double crepe_coherence = 0.35;  ///< relative band width of the distance: small means regular folds
  double fibres_per_mm2 = 30.0;
  double fibre_um = 25.0;      ///< diameter; softwood pulp has 30 to 40, flattened to less
  double formation_um = 10.0;  ///< root mean square of the sheet's uneven thickness over about a millimetre
  double size_mm = 16.0;       ///< least period of the random surface
  std::uint64_t seed = 1;
};

void fields(YamlReader& in, TissueRelief& relief);
/// One period, random by `seed`.
fem::ReliefMap relief_map(const TissueRelief& relief);
/// The narrowest thing of it that a tile shows, mm: kTileDetail.
double finest_detail(const TissueRelief& relief);

}  // namespace touchstone::sim
