#pragma once
// Force as a linear function of one measure of the picture [Li2015, sec. 4.2 and 4.3]: normal force of the sum of the
// height map, for each shape of indenter; shear force of the mean marker displacement, for each gel. Good for the gel,
// and the shape, that it was fitted to, and within the range that it saw.

#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <opencv2/core/mat.hpp>
#include <span>

namespace touchstone::sensors {

/// force = newton_per_unit * measure + offset_N
struct LinearForce {
  double newton_per_unit = 0.0;
  double offset_N = 0.0;
  double r2 = 0.0;  ///< 1 - (squares of residuals)/(squares about the mean force); below 0: worse than the mean
  double rms_residual_N = 0.0;      ///< root mean square
  double largest_residual_N = 0.0;  ///< absolute
  double lowest_seen = 0.0;         ///< the range of the measure in the samples
  double highest_seen = 0.0;
  int samples = 0;

  double force_N(double measure) const { return newton_per_unit * measure + offset_N; }
  /// Standard error of one force that the line gives: what its samples are off from it by, two numbers being fitted.
  /// How well they stand for what is touched later isn't in it.
  double standard_error_N() const {
    return samples > 2 ? rms_residual_N * std::sqrt(samples / (samples - 2.0))
                       : std::numeric_limits<double>::infinity();
  }
  bool has_seen(double measure) const { return measure >= lowest_seen && measure <= highest_seen; }
};

/// Which line is fitted to the samples.
enum class FitLine {
  kFree,           ///< slope and offset
  kThroughOrigin,  ///< slope only: no force where nothing is measured
};

/// Least squares in the force. @throws Error for lists of unequal lengths, fewer than three samples, a value that isn't
/// finite, or measures (or forces) that are all equal to 12 digits
LinearForce fit_linear_force(std::span<const double> measure, std::span<const double> force_N, FitLine line);

/// The line through the origin for shear, in both directions at once: forces on the gel (N) along the picture's u and v
/// against mean marker displacements (mm) along the same. Residuals are those of one component; `lowest_seen` and
/// `highest_seen` are lengths. @throws Error as fit_linear_force, the lengths being its measures; where displacements
/// don't go along their forces, as where the two have other axes
LinearForce fit_shear_force(std::span<const Eigen::Vector2d> displacement_mm, std::span<const Eigen::Vector2d> force_N);

/// Shear force on the gel (N, along the picture's u and v) of a mean marker displacement (mm) by a gel's line for
/// shear. It has the displacement's direction: a gel is as stiff along u as along v.
Eigen::Vector2d shear_force_N(const LinearForce& line, const Eigen::Vector2d& displacement_mm);

/// The sum of a height map times a pixel's area: the volume of the dent, so that a fit doesn't depend on the
/// resolution. Heights below 0 count too, so noise has no mean. @throws Error unless the map is CV_32FC1 (mm), not
/// empty and finite, and the pitch is positive
double height_sum_mm3(const cv::Mat& height_mm, double mm_per_px);

/// How many of the first samples belong to the rise before slip: those before the first that reaches `part` of the
/// largest force. With a force that is held back by friction from there on, this is the linear part of fig. 4-6.
/// @pre 0 < part <= 1
std::size_t samples_before_slip(std::span<const double> force_N, double part);

}  // namespace touchstone::sensors
