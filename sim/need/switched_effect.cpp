#include "sim/need/switched_effect.h"

#include "core/error.h"

namespace touchstone::sim {

std::optional<SwitchedScene> switched(const SceneSpec& scene, const Plan& plan, const SwitchedEffect& effect) {
  SwitchedScene other{scene, {}};
  other.scene.effects.*effect.of = plan.*effect.planned ? Switch::off : Switch::on;
  try {
    other.plan = make_plan(other.scene);
  } catch (const Error&) {
    return std::nullopt;
  }
  return other;
}

}  // namespace touchstone::sim
