#pragma once

#include "sim/plan/plan_table.h"

namespace touchstone::sim {

/// The effects of time on what the camera delivers: motion blur, rolling shutter, event pixels; and how many pressed
/// states a frame they want. @pre the device has a camera
/// @throws Error where the camera can't have what the scene asks for
void plan_time(const SceneSpec& scene, Plan& plan, PlanTable& table);

}  // namespace touchstone::sim
