#include "fem/contact/patch_motion.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace touchstone::fem {
namespace {

constexpr double kStill = 2.0;  // points that don't spin

}  // namespace

Eigen::Vector3d PatchMotion::displacement(const Eigen::Vector3d& point) const {
  if (spin == 0.0) return translation;
  const Eigen::Vector3d arm = point - centre;
  return translation + Eigen::AngleAxisd(spin, normal) * arm - arm;
}

PatchMotion mean_patch_motion(std::span<const Eigen::Vector3d> points, std::span<const Eigen::Vector3d> normals,
                              std::span<const Eigen::Vector3d> displacements, std::span<const double> weights) {
  PatchMotion motion;
  double sum = 0.0;
  double squares = 0.0;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < points.size(); ++k) {
    sum += weights[k];
    squares += weights[k] * weights[k];
    centre += weights[k] * points[k];
    normal += weights[k] * normals[k];
    translation += weights[k] * displacements[k];
  }
  if (!(sum > 0.0)) return motion;
  motion.centre = centre / sum;
  motion.normal = normal.normalized();
  translation /= sum;
  motion.translation = translation - motion.normal.dot(translation) * motion.normal;
  // As many as they would be with equal weights.
  const double several = std::clamp(sum * sum / squares - kStill, 0.0, 1.0);
  if (several == 0.0) return motion;
  // Least squares over the angle of |R a - a - (u - mean u)|^2, exactly: tan(angle) from the sums of a x b and a . b,
  // b = a + u - mean u being where the arm a has gone.
  double sine = 0.0;
  double cosine = 0.0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    Eigen::Vector3d arm = points[k] - motion.centre;
    arm -= motion.normal.dot(arm) * motion.normal;
    Eigen::Vector3d gone = arm + displacements[k] - translation;
    gone -= motion.normal.dot(gone) * motion.normal;
    sine += weights[k] * motion.normal.dot(arm.cross(gone));
    cosine += weights[k] * arm.dot(gone);
  }
  if (cosine > 0.0) motion.spin = several * std::atan2(sine, cosine);
  return motion;
}

}  // namespace touchstone::fem
