#pragma once
// Reliefs in closed form: waves along one axis or both, and round hairs.

#include "core/yaml_reader.h"
#include "fem/shapes/relief_map.h"

namespace touchstone::sim {

/// (1 - cos)/2 along x; crests lie along y.
struct WavesRelief {
  static constexpr const char* kType = "waves";
  static constexpr bool kSharp = true;
  double amplitude_um = 0.0;  ///< trough to crest
  double pitch_mm = 0.0;      ///< the period
};

/// The mean of such waves along x and along y.
struct GridRelief {
  static constexpr const char* kType = "grid";
  static constexpr bool kSharp = true;
  double amplitude_um = 0.0;  ///< trough to crest
  double pitch_mm = 0.0;      ///< the period along either axis
};

/// Round hairs on the floor, along y.
struct HairRelief {
  static constexpr const char* kType = "hair";
  static constexpr bool kSharp = true;
  double amplitude_um = 0.0;  ///< the diameter
  double pitch_mm = 0.0;      ///< from one to the next; 0: a single one at x = 0
};

void fields(YamlReader& in, WavesRelief& relief);
void fields(YamlReader& in, GridRelief& relief);
void fields(YamlReader& in, HairRelief& relief);

/// One period of the waves, or the hair, without end along y.
fem::ReliefMap relief_map(const WavesRelief& relief);
fem::ReliefMap relief_map(const GridRelief& relief);
fem::ReliefMap relief_map(const HairRelief& relief);

/// The waves' period, the hair's diameter, mm.
double finest_detail(const WavesRelief& relief);
double finest_detail(const GridRelief& relief);
double finest_detail(const HairRelief& relief);

/// What every kind's `amplitude_um` may be.
inline constexpr double kHighestRelief_um = 5000.0;

}  // namespace touchstone::sim
