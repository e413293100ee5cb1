#include "core/transform.h"

#include "core/error.h"

namespace touchstone {

Eigen::Matrix3d rotation_from_xyz(const Eigen::Vector3d& angles) {
  return (Eigen::AngleAxisd(angles.z(), Eigen::Vector3d::UnitZ()) *
          Eigen::AngleAxisd(angles.y(), Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(angles.x(), Eigen::Vector3d::UnitX()))
      .toRotationMatrix();
}

RigidTransform look_at(const Eigen::Vector3d& eye, const Eigen::Vector3d& target, const Eigen::Vector3d& down) {
  const Eigen::Vector3d z = (target - eye).normalized();
  const Eigen::Vector3d y = (down - down.dot(z) * z).normalized();
  TS_ASSERT(z.allFinite() && y.allFinite());
  RigidTransform frame;
  frame.rotation.col(0) = y.cross(z);
  frame.rotation.col(1) = y;
  frame.rotation.col(2) = z;
  frame.translation = eye;
  return frame;
}

}  // namespace touchstone
