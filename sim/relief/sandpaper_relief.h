#pragma once
// Coated abrasives: sharp grains of a graded size, standing in resin.

#include <cstdint>

#include "core/yaml_reader.h"
#include "fem/shapes/relief_map.h"

namespace touchstone::sim {

/// Grains of one grade on their paper.
struct SandpaperRelief {
  static constexpr const char* kType = "sandpaper";
  static constexpr bool kSharp = false;

  int grit = 120;     ///< FEPA P-grade: one that grain_size_mm() knows
  double coat = 0.7;  ///< share of the area under grains; a closed coat has 0.7 and more, an open one about half
  double size_spread = 0.15;        ///< relative standard deviation of a grain's size
  double protrusion = 0.5;          ///< mean share of a grain's size that stands out of the resin
  double protrusion_spread = 0.15;  ///< its standard deviation, as a share of the size
  double backing_um = 4.0;          ///< root mean square waviness of the paper below
  double size_mm = 16.0;            ///< period of the random surface
  std::uint64_t seed = 1;
};

void fields(YamlReader& in, SandpaperRelief& relief);
/// One period, random by `seed`.
fem::ReliefMap relief_map(const SandpaperRelief& relief);
/// The narrowest thing of it that a tile shows, mm: kTileDetail.
double finest_detail(const SandpaperRelief& relief);

/// Mean grain size of a FEPA P-grade, mm: sieve grades of [ISO6344, part 2] (P40 425 um, P60 269, P80 201, P100 162,
/// P120 125, P150 100, P180 82, P220 68) and sedimentation grades' ds50 of [ISO6344, part 3] (P240 58.5, P280 52.2,
/// P320 46.2, P400 35.0).
/// @throws Error for another grade, naming those that are known
double grain_size_mm(int grit);

/// Grains a mm^2, from the coat and the mean area of a grain.
double grains_per_mm2(const SandpaperRelief& relief);

}  // namespace touchstone::sim
