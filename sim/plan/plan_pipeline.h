#pragma once

#include "sim/plan/plan_table.h"

namespace touchstone::sim {

/// What a camera does to its pictures between the light and what it delivers, but for the noise: each is on where the
/// device states it. After the noise was planned, without which there are no hot pixels and no JPEG: such pictures are
/// ideal ones. @pre the device has a camera
/// @throws Error where an automatic exposure would be longer than a frame of the motion
void plan_pipeline(const SceneSpec& scene, Plan& plan, PlanTable& table);

}  // namespace touchstone::sim
