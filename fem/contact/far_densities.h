#pragma once
// What densities of traction do to each other where they are well apart: by mass, centre and second moments.
//
// A smooth kernel's mean over two densities is its value between their centres, and half its curvature times the sum of
// their second moments. That is had from four points: the centres' distance plus and minus the root of twice those
// moments, along two directions. What is left is of fourth order in the densities' width over their distance.

#include <Eigen/Core>
#include <vector>

#include "fem/contact/half_space_response.h"

namespace touchstone::fem {

/// What a density adds up to.
struct DensityMoments {
  double mass = 0.0;                                 ///< mm^2
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< mm
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();  ///< mm^2: mean of (x - centre)(x - centre)^T

  /// With another's mass added to it.
  void add(const DensityMoments& other);
};

/// Responses of a half-space between one density and others.
class FarDensities {
 public:
  /// Rows of an answer if not of pressure alone: those of ResponseTerms.
  static constexpr int kTerms = 6;

  /// Keeps the reference.
  FarDensities(const HalfSpaceResponse& half_space, bool normal_only)
      : half_space_(half_space), normal_only_(normal_only) {}

  /// mm^3/MPa, a row for each of `others`: (normal by normal) and, if not `normal_only`, (normal by first tangent,
  /// normal by second, first by first, first by second, second by second), the latter three beyond the first. A
  /// response of `a` to `others`; valid until the next call.
  const Eigen::ArrayXXd& responses(const DensityMoments& a, const Eigen::Vector3d& first, const Eigen::Vector3d& second,
                                   const std::vector<const DensityMoments*>& others);

 private:
  const HalfSpaceResponse& half_space_;
  bool normal_only_;
  Eigen::ArrayXXd pairs_, place_, terms_;
  Eigen::ArrayXd distance_, weight_;
};

}  // namespace touchstone::fem
