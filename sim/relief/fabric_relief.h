#pragma once
// Cloth: yarns that cross over and under each other, loops of a knit, a cut pile in ribs, or matted fibres.

#include <Eigen/Core>
#include <cstdint>

#include "core/yaml_reader.h"
#include "fem/shapes/relief_map.h"

namespace touchstone::sim {

/// How the yarns are bound.
enum class Weave {
  plain,        ///< over one, under one
  basket,       ///< plain weave of pairs of yarns
  twill,        ///< each end passes over `over` picks and under `under`, shifted by one from end to end: diagonal ribs
  herringbone,  ///< twill whose diagonal turns back every 8 ends
  satin,        ///< each end passes over all but one of `harness` picks, shifted by `step`: long floats
  knit,         ///< plain jersey, its face: columns of V
  corduroy,     ///< tufts of a cut pile in ribs along y
  felt,         ///< matted fibres, no yarns
};
EnumNames<Weave> enum_names(Weave);

/// A cloth, laid flat. The pattern is regular, each yarn's width and the fuzz are random.
struct FabricRelief {
  static constexpr const char* kType = "fabric";
  static constexpr bool kSharp = false;

  Weave weave = Weave::plain;
  /// From yarn to yarn: of the warp's ends (which run along y), of the weft's picks (along x). Knit: from wale to wale,
  /// from course to course. Corduroy: from rib to rib, both alike.
  Eigen::Vector2d pitch_mm = {0.5, 0.5};
  Eigen::Vector2d yarn_mm = {0.45, 0.45};  ///< width of a warp and a weft yarn; knit: both alike; felt: of fibres
  double thickness_mm = 0.2;  ///< of a yarn, lying flattened; corduroy: height of the pile; felt: depth of the mat
  double warp_crimp = 0.5;    ///< share of the waviness that the warp takes; the weft takes the rest
  int over = 2, under = 1;    ///< twill, herringbone
  int harness = 5, step = 2;  ///< satin
  double twist_mm = 0.0;      ///< length of a turn of a yarn's twist; 0: none to be seen
  double twist_um = 0.0;      ///< depth of the ridges that the twist makes
  double irregularity = 0.1;  ///< relative standard deviation of a yarn's width and thickness along it
  double fuzz_per_mm2 = 0.0;  ///< loose fibres; felt: the fibres of the mat
  double roughness_um = 2.0;  ///< of the fibres within the yarns, root mean square
  double size_mm = 16.0;      ///< least period of the whole random surface
  std::uint64_t seed = 1;
};

void fields(YamlReader& in, FabricRelief& relief);
/// One period, random by `seed`.
fem::ReliefMap relief_map(const FabricRelief& relief);
/// The narrowest thing of it that a tile shows, mm: kTileDetail.
double finest_detail(const FabricRelief& relief);

/// Whether warp end `end` lies over weft pick `pick`, in a woven cloth. @pre the weave is one of the first five
bool warp_is_over(const FabricRelief& relief, int end, int pick);

}  // namespace touchstone::sim
