#pragma once

#include "apps/command.h"
#include "sim/plan/plan.h"
#include "sim/scene/scene.h"

namespace touchstone::apps {

/// Measures what each effect changes in a scene as the plan does, and once more closely (sim::kCloseLook), and prints
/// both, beside what is allowed and whether the effect is on in `plan`.
void print_plan_check(const sim::SceneSpec& scene, const sim::Plan& plan, const GlobalOptions& global);

}  // namespace touchstone::apps
