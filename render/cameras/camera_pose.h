#pragma once

#include "core/transform.h"

namespace touchstone::render {

/// @throws Error unless the pose is a rotation and a translation of at most 100 m: beyond that single precision, in
/// which Embree traces, steps by more than 8 um
void check_camera_pose(const RigidTransform& gel_from_camera);

}  // namespace touchstone::render
