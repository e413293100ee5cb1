#include "core/transform.h"

#include <algorithm>
#include <cmath>

#include <cmath>

#include "core/error.h"

namespace touchstone {

Eigen::Matrix3d rotation_from_xyz(const Eigen::Vector3d& angles) {
  return (Eigen::AngleAxisd(angles.z(), Eigen::Vector3d::UnitZ()) *
          Eigen::AngleAxisd(angles.y(), Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(angles.x(), Eigen::Vector3d::UnitX()))
      .toRotationMatrix();
}

RigidTransform look_at(const Eigen::Vector3d& eye, const Eigen::Vector3d& target, const Eigen::Vector3d& down) {
  const double distance = (target - eye).norm();
  TS_ASSERT(distance > 0.0 && std::isfinite(distance));
  const Eigen::Vector3d z = (target - eye) / distance;
  const Eigen::Vector3d across = down - down.dot(z) * z;
  TS_ASSERT(across.norm() > 1e-12 * down.norm());  // `down` isn't along the view
  const Eigen::Vector3d y = across.normalized();
  RigidTransform frame;
  frame.rotation.col(0) = y.cross(z);
  frame.rotation.col(1) = y;
  frame.rotation.col(2) = z;
  frame.translation = eye;
  return frame;
}

Eigen::Vector3d xyz_from_rotation(const Eigen::Matrix3d& rotation) {
  return {std::atan2(rotation(2, 1), rotation(2, 2)), -std::asin(std::clamp(rotation(2, 0), -1.0, 1.0)),
          std::atan2(rotation(1, 0), rotation(0, 0))};
}

}  // namespace touchstone
