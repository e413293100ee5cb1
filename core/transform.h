#pragma once
// Frames and transforms.
//
// Gel frame: origin at the centre of the undeformed outer surface, +z out of the gel towards the object; a press
// moves the object along -z. Lengths are in mm, angles in radians.
// Camera frame: origin at the centre of projection, +z along the view, +x to the image's right, +y down the image.
// Image: origin at the top left corner of the top left pixel; pixel (column i, row j) has its centre at
// (i + 0.5, j + 0.5).
// A transform is named `a_from_b`: it takes coordinates in frame b to coordinates in frame a.

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace touchstone {

/// A rotation followed by a translation: p_a = rotation * p_b + translation (mm).
struct RigidTransform {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const { return rotation * point + translation; }
  /// Of `other` first, then of this.
  RigidTransform operator*(const RigidTransform& other) const {
    return {rotation * other.rotation, rotation * other.translation + translation};
  }
  /// Turns a free vector (a direction, a force), without the translation.
  Eigen::Vector3d turn(const Eigen::Vector3d& vector) const { return rotation * vector; }
  RigidTransform inverse() const { return {rotation.transpose(), -(rotation.transpose() * translation)}; }
};

/// Rotation about the fixed axes x, then y, then z by the given angles (radians): R = Rz Ry Rx.
Eigen::Matrix3d rotation_from_xyz(const Eigen::Vector3d& angles);
/// Its inverse: the angles of a rotation, the one about y within a quarter turn.
Eigen::Vector3d xyz_from_rotation(const Eigen::Matrix3d& rotation);

/// A camera at `eye` that looks at `target`, the image's downward direction being nearest to `down`.
/// @pre eye != target and `down` isn't along the view.
RigidTransform look_at(const Eigen::Vector3d& eye, const Eigen::Vector3d& target, const Eigen::Vector3d& down);

}  // namespace touchstone
