#pragma once

#include <optional>

#include "sim/plan/plan.h"
#include "sim/scene/scene.h"

namespace touchstone::sim {

/// An effect that a scene may switch, and where its plan says whether it is on.
struct SwitchedEffect {
  const char* name;  ///< as in Plan::effects
  Switch EffectSwitches::*of;
  bool Plan::*planned;
};

/// Those of what is seen that have no closed form: they are measured by tracing pixels.
inline constexpr SwitchedEffect kSeenEffects[] = {
    {"interreflection", &EffectSwitches::interreflection, &Plan::interreflection},
    {"fine relief", &EffectSwitches::fine_relief, &Plan::fine_relief},
    {"diffraction", &EffectSwitches::diffraction, &Plan::diffraction},
};

/// A scene with one effect the other way, and its plan.
struct SwitchedScene {
  SceneSpec scene;
  Plan plan;
};

/// Switches `effect` to what it isn't in `plan`, which is the scene's. Nothing if the scene can't have it so.
std::optional<SwitchedScene> switched(const SceneSpec& scene, const Plan& plan, const SwitchedEffect& effect);

}  // namespace touchstone::sim
