#include "sensors/touch_map/planar_pose.h"

#include <Eigen/Dense>
#include <algorithm>

#include "core/error.h"

namespace touchstone::sensors {
namespace {

using Points = std::span<const Eigen::Vector2d>;

// Below this ratio of the spreads along and across, points are taken for collinear.
constexpr double kFlatSpread = 1e-6;

Eigen::Vector2d centroid(Points points) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& point : points) sum += point;
  return sum / static_cast<double>(points.size());
}

}  // namespace

PlanarPose PlanarPose::operator*(const PlanarPose& other) const {
  return {wrapped(angle + other.angle), rotation() * other.translation + translation};
}

PlanarPose PlanarPose::inverse() const {
  return {wrapped(-angle), -(rotation().transpose() * translation)};
}

double wrapped(double angle) {
  const double rest = std::remainder(angle, 2.0 * kPi);
  return rest <= -kPi ? kPi : rest;
}

PlanarPose least_squares_isometry(Points to, Points from) {
  TS_ASSERT(to.size() == from.size() && to.size() >= 2);
  const Eigen::Vector2d to_middle = centroid(to), from_middle = centroid(from);
  double dot = 0.0, cross = 0.0;
  for (std::size_t i = 0; i < to.size(); ++i) {
    const Eigen::Vector2d a = from[i] - from_middle, b = to[i] - to_middle;
    dot += a.dot(b);
    cross += a.x() * b.y() - a.y() * b.x();
  }
  PlanarPose pose;
  pose.angle = wrapped(std::atan2(cross, dot));
  pose.translation = to_middle - pose.rotation() * from_middle;
  return pose;
}

Eigen::Matrix2d least_squares_linear_part(Points to, Points from) {
  TS_ASSERT(to.size() == from.size());
  if (from.size() < 3) return Eigen::Matrix2d::Zero();
  const Eigen::Vector2d to_middle = centroid(to), from_middle = centroid(from);
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero(), mixed = Eigen::Matrix2d::Zero();
  for (std::size_t i = 0; i < to.size(); ++i) {
    const Eigen::Vector2d a = from[i] - from_middle;
    spread += a * a.transpose();
    mixed += (to[i] - to_middle) * a.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(spread);
  if (!(axes.eigenvalues()[0] > kFlatSpread * axes.eigenvalues()[1])) return Eigen::Matrix2d::Zero();
  return mixed * spread.inverse();
}

double isometry_confidence(const Eigen::Matrix2d& linear_part) {
  return std::max(1.0 - std::abs(1.0 - linear_part.determinant()), 0.0);
}

}  // namespace touchstone::sensors
