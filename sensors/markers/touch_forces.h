#pragma once
// A gel's lines from touches whose forces are known (gel_force_model.h): what a TouchReader without lines measured in
// each frame, beside what a force sensor said.

#include <Eigen/Core>
#include <array>
#include <optional>
#include <span>
#include <string>

#include "sensors/markers/gel_force_model.h"
#include "sensors/markers/touch_reader.h"

namespace touchstone::sensors {

/// What one frame showed, and its force.
struct TouchForceSample {
  std::optional<double> height_sum_mm3;                ///< none: read without heights
  Eigen::Vector2d moved_mm = Eigen::Vector2d::Zero();  ///< mean of the patch's markers since rest, along u and v
  Eigen::Vector3d force_N =
      Eigen::Vector3d::Zero();  ///< on the object: x along u, y along v, z out of the gel; a press has z > 0
  int series = 0;               ///< press or recording that it belongs to
};

/// None of a frame that isn't trusted, in which nothing touches, or without a marker on the patch.
std::optional<TouchForceSample> force_sample(const TouchReading& touch, const Eigen::Vector3d& force_N,
                                             double mm_per_px, int series);

/// Puts a model's lines into what is known of a gel: shear, and with heights the normal force of that indenter.
/// @param indenter empty: the model's only one
/// @throws Error for an indenter that the model hasn't, or that has to be named; for a gel whose mm_per_px isn't the
/// model's within 1 %; where heights are missing and the model has no shear
void use_forces(TouchCalibration& parts, const GelForceModel& model, const std::string& indenter = "");

/// The lines, and how well they do on series that they weren't fitted to.
struct GelForceFit {
  GelForceModel model;
  /// Of x, y, z: root mean square error, N, on each series by lines of the others; none without a line, or of one
  /// series.
  std::array<std::optional<double>, 3> left_out_N;
};

/// Fits the line of normal force, if the samples have heights, and that of shear, if they are sheared: by a tenth or
/// more of the largest force. @param gel, indenter the model's names
/// @throws Error as fit_linear_force and fit_shear_force; for samples of which some have heights and some not; where
/// neither line can be had
GelForceFit fit_gel_forces(std::span<const TouchForceSample> samples, double mm_per_px, const std::string& gel,
                           const std::string& indenter);

}  // namespace touchstone::sensors
