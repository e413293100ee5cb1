#pragma once

#include <Eigen/Core>
#include <cmath>
#include <numbers>

#include "sensors/tractions/marker_compliance.h"

namespace touchstone::sensors::fixtures {

/// Displacement of an incompressible half space's face, r away from a force along each axis ([Johnson1985, eqs. 3.19,
/// 3.75] with a Poisson's ratio of 1/2), times pi E.
inline Eigen::Matrix3d half_space_answer(const Eigen::Vector2d& r) {
  const double distance = r.norm();
  Eigen::Matrix3d answer = Eigen::Matrix3d::Zero();
  answer.topLeftCorner<2, 2>() = 0.75 / distance * (Eigen::Matrix2d::Identity() + r * r.transpose() / r.squaredNorm());
  answer(2, 2) = 0.75 / distance;
  return answer;
}

/// A grid of square markers 2 mm wide and 3 mm apart on an incompressible half space, under square patches: sums over
/// points of patch and marker that never meet.
inline MarkerCompliance half_space_markers(int markers, int patches, double side, double youngs_modulus = 0.4) {
  MarkerCompliance c;
  c.marker_grid = {markers, markers};
  c.patch_grid = {patches, patches};
  c.patch_side = side;
  c.first_patch = Eigen::Vector2d::Constant(-0.5 * side * (patches - 1));
  c.thickness = 5.0;
  c.youngs_modulus = youngs_modulus;
  c.poisson_ratio = 0.5;
  c.gel = "half space";
  c.displacement.setZero(3 * c.markers(), 3 * c.patches());
  constexpr int kOfMarker = 3, kOfPatch = 4;
  for (int m = 0; m < c.markers(); ++m) {
    const Eigen::Vector2d at = 3.0 * (Eigen::Vector2d(m % markers, m / markers).array() - 0.5 * (markers - 1)).matrix();
    c.marker_rest.emplace_back(at.x(), at.y(), 0.0);
    for (int p = 0; p < c.patches(); ++p) {
      Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
      for (int a = 0; a < kOfMarker * kOfMarker; ++a) {
        const Eigen::Vector2d of_marker(a % kOfMarker - 1, a / kOfMarker - 1);
        for (int b = 0; b < kOfPatch * kOfPatch; ++b) {
          const Eigen::Vector2d of_patch(b % kOfPatch - 1.5, b / kOfPatch - 1.5);
          // A hundredth aside, so that no two points meet.
          sum += half_space_answer(at + 2.0 / kOfMarker * of_marker - c.patch_centre(p) - side / kOfPatch * of_patch +
                                   Eigen::Vector2d(0.011, 0.017));
        }
      }
      c.displacement.block<3, 3>(3 * m, 3 * p) =
          sum * c.patch_area() / (kOfPatch * kOfPatch * kOfMarker * kOfMarker) / (std::numbers::pi * youngs_modulus);
    }
  }
  return c;
}

}  // namespace touchstone::sensors::fixtures
