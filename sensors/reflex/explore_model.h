#pragma once
// From the motion of the dots to press and force, as explore mode learned it [Knoop2013, sec. III.E and IV.C], and its
// file. Shear, which the paper leaves open, goes the same way: shift, lateral displacement, force.

#include <filesystem>
#include <optional>
#include <string>

#include "sensors/reflex/dots_motion.h"
#include "sensors/reflex/press_law.h"
#include "sensors/reflex/shear_law.h"

namespace touchstone::sensors {

/// A calibrated model of one fingertip.
struct ExploreModel {
  DilationPress press;
  ExponentialForce force;
  /// The skin's lateral displacement, mm, from the shift over the dilation: what comes nearer moves faster in the
  /// picture. 2x2, so that the chip may be turned.
  Eigen::Matrix2d lateral_mm_per_px = Eigen::Matrix2d::Zero();
  std::optional<ShearLaw> shear;  ///< of the lateral displacement, mm
};

/// Press and forces of one picture.
struct ExploreForce {
  double press_mm = 0.0;
  double force_N = 0.0;
  Eigen::Vector2d lateral_mm = Eigen::Vector2d::Zero();
  Eigen::Vector2d shear_N = Eigen::Vector2d::Zero();  ///< 0 without a law for it
};
/// Of a motion since rest. Never throws: a motion beyond the calibration gives what its laws say there.
ExploreForce estimate(const ExploreModel& model, const DotsMotion& motion);

/// mm per pixel of shift over dilation, 2x2, by least squares from known lateral displacements.
struct LateralSample {
  DotsMotion motion;
  Eigen::Vector2d lateral_mm = Eigen::Vector2d::Zero();
};
/// @throws Error for fewer than 4 samples, values that aren't finite, or shifts all along one line
Eigen::Matrix2d fit_lateral(std::span<const LateralSample> samples);

/// What is wrong with it; empty if nothing is.
std::string fault_of(const ExploreModel& model);

/// JSON with a checksum, as it is written. @throws Error for a model with a fault
std::string to_json(const ExploreModel& model);
/// @throws Error naming file and field, for what isn't such a file, is damaged, or holds a model with a fault
ExploreModel explore_model_from_json(const std::string& text, const std::string& name);

/// @throws Error as to_json(), or if the file can't be written
void save(const ExploreModel& model, const std::filesystem::path& path);
/// @throws Error as explore_model_from_json(), or if the file can't be read
ExploreModel load_explore_model(const std::filesystem::path& path);

}  // namespace touchstone::sensors
