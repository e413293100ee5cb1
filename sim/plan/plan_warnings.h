#pragma once

#include "sim/plan/need.h"
#include "sim/plan/plan.h"

namespace touchstone::sim {

/// Adds to Plan::warnings what is likely a mistake (size_doubt.h), and where the accuracy that is stated can't be had:
/// what stops it, and the least that can be had. @pre the plan's rows are made
void add_warnings(const SceneSpec& scene, const SceneNeeds& needs, Plan& plan);

}  // namespace touchstone::sim
