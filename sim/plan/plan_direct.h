#pragma once

#include <string>

#include "sim/plan/plan_table.h"

namespace touchstone::sim {

/// Why pictures of this scene can't be made with direct light, as far as files tell; empty if they may be. Whether they
/// come near enough to path tracing is measured where the camera is made (sim/sensor/direct_light.h).
/// @pre the plan's other rows of light and time are made
std::string unfit_for_direct_light(const SceneSpec& scene, const Plan& plan);

/// Does the hole's or stop's diffraction (render/cameras/diffraction_spread.h) count? Only where it was measured to
/// change more than is allowed, or the scene switches it on. @pre as above
/// @throws Error if the scene switches it on and can't have it
void plan_diffraction(const SceneSpec& scene, Plan& plan, PlanTable& table);

/// Is direct light from a light field (render/direct/direct_renderer.h) worth a try? @pre as above
/// @throws Error if the scene switches it on and is unfit
void plan_direct_light(const SceneSpec& scene, Plan& plan, PlanTable& table);

/// How many paths a pixel gets where pictures are traced (sim/scene/light_limits.h).
/// @pre the row of direct light is made
void plan_paths(const SceneSpec& scene, const Plan& plan, PlanTable& table);

/// Do neighbouring pixels share their paths (render/paths/shared_paths.h), as they may behind a hole much wider than
/// they are?
/// @pre the row of direct light is made
/// @throws Error if the scene switches it on and is unfit
void plan_shared_paths(const SceneSpec& scene, Plan& plan, PlanTable& table);

}  // namespace touchstone::sim
