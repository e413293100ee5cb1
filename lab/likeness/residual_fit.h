#pragma once
// Learns a residual map (sim/scene/residual_map.h) from recorded presses of a ball and a device's pictures of the same
// presses. Its strength and whether the place counts are chosen by leaving out one press after the other.

#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "sim/scene/residual_map.h"

namespace touchstone::lab {

/// What one press tells. Pictures have one size; colours are red, green, blue.
struct ResidualSample {
  std::string name;
  cv::Mat height;     ///< CV_32FC1, mm: Touch::height of the device
  cv::Mat missing;    ///< CV_32FC3: recorded less simulated difference to rest, linear numbers of 255 without limits
  cv::Mat saturated;  ///< CV_8UC3, not 0 where the recorded number is only known to be at least this
};

/// What one press is like with a map of the others: root mean square over pixels and colours of what is missing.
struct LeftOutPress {
  std::string name;
  double before_DN = 0.0, after_DN = 0.0;
};

/// A map and how it was found.
struct ResidualFit {
  sim::ResidualMap map;
  std::vector<LeftOutPress> left_out;
  double ridge = 0.0;  ///< the penalty that was chosen, a part of the mean square bump
};

/// What a map needs at least.
inline constexpr int kFewestResidualPresses = 3;

/// Where the recorded number is saturated, only too little light counts as missing. `about`: ResidualMap::about.
/// @throws Error for fewer than kFewestResidualPresses samples, or if nothing is pressed in them
ResidualFit fit_residual(const std::vector<ResidualSample>& samples, double mm_per_px, const std::string& about);

}  // namespace touchstone::lab
