#pragma once
// Coverages of pixels, of 255. For the .cpp files of ColourMarkerFinder only.

#include <algorithm>

namespace touchstone::sensors {

inline constexpr int kHalfCovered = 128;
inline constexpr double kNoCoverage = 0.15;  ///< noise, and what ink and filter take of each other's channel
inline constexpr double kFullCoverage = 0.85;

/// What a pixel counts by: 0 up to kNoCoverage, 1 from kFullCoverage on. The ramp between is symmetric about a half, so
/// a blurred rim counts as much as a sharp one.
inline double weight_of(int coverage) {
  return std::clamp((coverage / 255.0 - kNoCoverage) / (kFullCoverage - kNoCoverage), 0.0, 1.0);
}

}  // namespace touchstone::sensors
