#pragma once

#include <Eigen/Core>
#include <span>

namespace touchstone::fem {

/// How a patch of the gel's surface has moved along itself as a whole: a translation and a spin about its normal.
struct PatchMotion {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< of the patch, undeformed
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();  ///< mm, across the normal
  double spin = 0.0;                                      ///< radians about the normal

  /// The displacement (mm) of the surface point `point`.
  Eigen::Vector3d displacement(const Eigen::Vector3d& point) const;

  bool operator==(const PatchMotion&) const = default;
};

/// The rigid motion that fits the points' displacements (mm) best in the weighted square mean. Weights >= 0; if all are
/// 0 it is none. Two points don't spin, three of equal weight do; the spin comes with the third one's weight.
PatchMotion mean_patch_motion(std::span<const Eigen::Vector3d> points, std::span<const Eigen::Vector3d> normals,
                              std::span<const Eigen::Vector3d> displacements, std::span<const double> weights);

}  // namespace touchstone::fem
