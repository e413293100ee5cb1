#pragma once
// Shear force from a lateral displacement of what is seen, where the stiffness grows with the normal force: a contact
// that is pressed harder is wider.

#include <Eigen/Core>
#include <span>

namespace touchstone::sensors {

/// shear_N = (stiffness + per_N * normal_N) displacement. The displacement may be in any unit, and along axes turned
/// against those of the force.
struct ShearLaw {
  Eigen::Matrix2d stiffness = Eigen::Matrix2d::Zero();
  Eigen::Matrix2d per_N = Eigen::Matrix2d::Zero();
  double rms_residual_N = 0.0;  ///< of the fit, both axes together: sqrt(mean of the error's square length)

  /// Both axes, N.
  Eigen::Vector2d force_N(const Eigen::Vector2d& displacement, double normal_N) const {
    return (stiffness + per_N * normal_N) * displacement;
  }
};

/// One known displacement with its forces.
struct ShearSample {
  Eigen::Vector2d displacement = Eigen::Vector2d::Zero();
  double normal_N = 0.0;
  Eigen::Vector2d shear_N = Eigen::Vector2d::Zero();
};

/// Least squares. @throws Error for fewer than 8 samples, values that aren't finite, or displacements and normal forces
/// that don't identify the eight figures (all along one line, or all of one normal force)
ShearLaw fit_shear_law(std::span<const ShearSample> samples);

}  // namespace touchstone::sensors
