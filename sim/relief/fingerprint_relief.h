#pragma once
// The ridges of a fingertip.

#include <Eigen/Core>
#include <cstdint>

#include "core/yaml_reader.h"
#include "fem/shapes/relief_map.h"

namespace touchstone::sim {

/// A whorl: a spiral of ridges round the z axis, longer along y, interrupted by minutiae (ends and forks) at random
/// places. The crests' heights are (1 + cos(phase))/2; the phase is 2 pi / ridge_mm times an ellipse's radius, one turn
/// of the spiral, and for each minutia the angle round it, of either sign ([Sherlock1993] draws prints with such
/// terms). The print fades out towards the ellipse size_mm.
struct FingerprintRelief {
  static constexpr const char* kType = "fingerprint";
  static constexpr bool kSharp = true;
  double amplitude_um = 0.0;  ///< trough to crest
  double ridge_mm = 0.45;     ///< from crest to crest, along x
  Eigen::Vector2d size_mm = Eigen::Vector2d(12.0, 15.0);
  int minutiae = 20;
  std::uint64_t seed = 1;  ///< of their places
};

void fields(YamlReader& in, FingerprintRelief& relief);
/// One finger's print, not repeated.
fem::ReliefMap relief_map(const FingerprintRelief& relief);
/// ridge_mm.
double finest_detail(const FingerprintRelief& relief);

}  // namespace touchstone::sim
