#pragma once
// A path's straight leg from event to event, and the legs of a path that are still to be followed.

#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "render/spectra/spectrum.h"

namespace touchstone::render {

inline constexpr int kRouletteFrom = 3;  ///< scatterings, at surfaces or in a medium, from which on chance ends paths

/// One straight leg: where it is, and what its path has met so far.
template <int N>
struct PathLeg {  // without default values: a path makes space for a dozen and mostly uses three
  Eigen::Vector3d origin, direction;
  Bands<N> throughput;
  double s_share;  ///< of the light, polarised square to the plane of incidence at the flat faces
  int layer, medium;
  int depth;   ///< diffuse and metallic reflections so far
  int smooth;  ///< mirror reflections and crossings of faces, Refractive surfaces and films since the last scattering
  std::int64_t scatterings;  ///< in media so far

  bool is_first_sight() const { return depth == 0 && scatterings == 0; }
};

/// Legs that wait to be followed.
template <int N>
struct PathBranches {
  static constexpr int kMost = 12;
  std::array<PathLeg<N>, kMost> legs;  // uninitialised on purpose, see PathLeg
  int count = 0;

  bool is_full() const { return count == kMost; }
  PathLeg<N>& next_free() { return legs[count]; }  ///< to be written, and kept by ++count
};

}  // namespace touchstone::render
