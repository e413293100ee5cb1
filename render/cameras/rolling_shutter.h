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
/// @throws Error if the times aren't finite, don't grow or don't cover the span
std::vector<double> exposure_shares(const std::vector<double>& times_s, double from_s, double to_s);

/// The same as rolling_exposure for instants that are handed over one by one and not kept.
class RollingExposure {
 public:
  /// @throws Error as rolling_exposure
  RollingExposure(const std::vector<double>& times_s, const ShutterTiming& timing, cv::Size size, int bands);

  /// The light at the time number `instant` and its standard error (CV_32FC1; may be empty: then nowhere any).
  void add(std::size_t instant, const cv::Mat& irradiance, const cv::Mat& standard_error = {});
  /// CV_32FC(bands). @pre each instant was added once
  cv::Mat irradiance() const;
  /// CV_32FC1, the instants' errors being independent.
  cv::Mat standard_error() const;

 private:
  std::vector<std::vector<double>> shares_;  // of each row: of each instant
  cv::Mat sum_;                              // CV_64FC(bands)
  cv::Mat variance_;                         // CV_64FC1
};

/// The mean irradiance of each row over its own exposure, linear in time between the instants: what an imager
/// (`expose`, imager.h) sees of a moving scene. Exact for light that changes linearly from instant to instant; how many
/// instants that needs is the caller's choice.
/// @throws Error if the instants don't cover the exposure of all rows, aren't in order, or differ in size or type
cv::Mat rolling_exposure(const std::vector<TimedIrradiance>& instants, const ShutterTiming& timing);

}  // namespace touchstone::render
