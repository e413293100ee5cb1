#pragma once
// Foams: cells of a random power diagram with walls between them.

#include <cstdint>

#include "core/yaml_reader.h"
#include "fem/shapes/relief_map.h"

namespace touchstone::sim {

/// What stands out and what lies deep.
enum class FoamKind {
  open,    ///< a net of struts, thicker where three meet, with pits between them; some walls are missing
  closed,  ///< walls, and between them cut cells as round bowls
  beads,   ///< inverted: domes with grooves between them (expanded beads)
};
EnumNames<FoamKind> enum_names(FoamKind);

/// A cut foam.
struct FoamRelief {
  static constexpr const char* kType = "foam";
  static constexpr bool kSharp = false;

  FoamKind kind = FoamKind::open;
  double cell_mm = 0.8;  ///< mean diameter: of a circle with the mean area of a cell
  double spread = 0.15;  ///< relative standard deviation that is asked of the cells' diameters, beside that of chance
  double wall_mm = 0.1;  ///< width of a strut or wall; beads: of the groove
  double depth_um = 200.0;     ///< of a mean pit below the struts, or of the grooves between beads
  double openness = 0.2;       ///< open: share of the walls that lie deep
  double roughness_um = 2.0;   ///< of the walls' faces and the bottoms, root mean square
  double roughness_mm = 0.1;   ///< its correlation length
  double unevenness_um = 0.0;  ///< of the cut: root mean square over lengths of two cells
  double size_mm = 16.0;       ///< period of the random surface
  std::uint64_t seed = 1;
};

void fields(YamlReader& in, FoamRelief& relief);
/// One period, random by `seed`.
fem::ReliefMap relief_map(const FoamRelief& relief);
/// The narrowest thing of it that a tile shows, mm: kTileDetail.
double finest_detail(const FoamRelief& relief);

}  // namespace touchstone::sim
