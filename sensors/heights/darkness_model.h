#pragma once
// What an estimator of heights from darkness knows of one sensor.

#include <string>
#include <vector>

#include "sensors/heights/darkening.h"

namespace touchstone::sensors {

/// From a darkening to a height: straight between knots, never falling, 0 for darkening 0.
struct DarknessCurve {
  static constexpr double kStep = 0.01;  ///< of the darkening, from knot to knot
  static constexpr int kMostKnots = 300;

  int first = 0;                   ///< number of the first knot, at most 0: knot n is at darkening n * kStep
  std::vector<double> heights_mm;  ///< see height_map.h: one a knot
  std::vector<double> spread_mm;   ///< RMS of the calibration's single pixels about the curve near each knot

  double brightest() const { return first * kStep; }  ///< darkening of the first knot
  double darkest() const { return (first + static_cast<int>(heights_mm.size()) - 1) * kStep; }  ///< of the last
  double deepest_mm() const { return heights_mm.back(); }                                       ///< calibrated

  /// Darker than calibrated, the last quarter of the curve goes on straight; brighter than calibrated, the height stays
  /// that of the first knot: how bright a bulge is no press of a ball shows.
  double height_at(double darkening) const;
  /// mm for one unit of darkening, of the last quarter of the curve.
  double last_slope() const;
};

/// All that calibration has found about one sensor, and all that its model file holds.
struct DarknessModel {
  double mm_per_px = 0.0;
  RestPicture rest;
  DarkeningSettings darkening;  ///< with which it was calibrated
  DarknessCurve curve;
  int presses = 0;  ///< that it was made of
};

/// What is wrong with a model, or the empty string.
std::string fault_of(const DarknessModel& model);

}  // namespace touchstone::sensors
