#pragma once
// Coverages of pixels, of 255. For the .cpp files of ColourMarkerFinder only.

namespace touchstone::sensors {

inline constexpr int kHalfCovered = 128;  ///< from there on a pixel belongs to the marker
/// From here on a pixel is ink for certain. Above a half, so two markers' ink with a blurred gap of a pixel between
/// them stays apart; the rims, by weight_of, come to them afterwards.
inline constexpr int kInkCore = 179;
/// Less is noise of white.
inline constexpr double kLeastCoverage = 0.06;

/// What a pixel counts by, 0 to 1: as much as is covered of it, so a rim counts right wherever it cuts a pixel.
inline double weight_of(int coverage) {
  const double part = coverage / 255.0;
  return part < kLeastCoverage ? 0.0 : part;
}

/// Of the usual area: what is smaller at rest is no filter.
inline constexpr double kLeastFilter = 0.4;

}  // namespace touchstone::sensors
