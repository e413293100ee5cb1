#pragma once
// Exposure in time: motion blur, and rows that are exposed one after the other.

#include <opencv2/core/mat.hpp>
#include <vector>

namespace touchstone::render {

/// Irradiance at an instant: CV_32FC(bands), W/m^2.
struct TimedIrradiance {
  double time_s = 0.0;
  cv::Mat irradiance;
};

/// When rows are exposed: row r from start_s + r line_time_s, for exposure_s.
struct ShutterTiming {
  double start_s = 0.0;
  double exposure_s = 0.0;   ///< 0: the instant
  double line_time_s = 0.0;  ///< 0: global shutter; below 0: the bottom row comes first in time
};

/// The share of each instant in the mean over [from_s, to_s] of what runs straight from instant to instant: the
/// integral of that instant's hat function, divided by the span; with from_s = to_s the hat functions' values. They sum
/// to 1.
/// @throws Error if the times don't grow or don't cover the span
std::vector<double> exposure_shares(const std::vector<double>& times_s, double from_s, double to_s);

/// The mean irradiance of each row over its own exposure, linear in time between the instants: what an imager
/// (`expose`, imager.h) sees of a moving scene. Exact for light that changes linearly from instant to instant; how many
/// instants that needs is the caller's choice.
/// @throws Error if the instants don't cover the exposure of all rows, aren't in order, or differ in size or type
cv::Mat rolling_exposure(const std::vector<TimedIrradiance>& instants, const ShutterTiming& timing);

}  // namespace touchstone::render
