#include "render/cameras/camera_pose.h"

#include "core/error.h"
#include "render/scene/scene_limits.h"

namespace touchstone::render {

void check_camera_pose(const RigidTransform& gel_from_camera) {
  const Eigen::Matrix3d& rotation = gel_from_camera.rotation;
  const Eigen::Vector3d& at = gel_from_camera.translation;
  if (!rotation.allFinite() || !at.allFinite() || !(rotation * rotation.transpose()).isIdentity(1e-6) ||
      rotation.determinant() < 0.0) {
    fail("camera: gel_from_camera isn't a finite rotation and translation");
  }
  if (at.cwiseAbs().maxCoeff() > kFarthest) {
    fail("camera: gel_from_camera puts it at ({}, {}, {}) mm; it must be within 100 m of the origin", at.x(), at.y(),
         at.z());
  }
}

}  // namespace touchstone::render
