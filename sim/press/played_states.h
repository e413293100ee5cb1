#pragma once
// A motion played state by state, for those who can't or needn't hold all of it.

#include <functional>
#include <memory>
#include <vector>

#include "fem/contact/press.h"
#include "fem/elements/compliance.h"
#include "fem/shapes/contact_shape.h"
#include "fem/vibration/vibration.h"
#include "sim/plan/plan.h"
#include "sim/scene/scene.h"

namespace touchstone::sim {

/// Takes the state at frame `frame` - 1 plus `part` / plan.states_a_frame. Frame 0 has its last part only.
using StateVisitor = std::function<void(int frame, int part, const fem::PressState& state)>;

/// Plays a scene's motion from its start and hands over plan.states_a_frame states a frame, in order; nothing is kept.
/// For `vibration`, `elastic` and `shapes` see play_motion. @throws Error as play_motion, and what `visit` throws
void play_states(const SceneSpec& scene, const Plan& plan, const fem::Compliance& gel,
                 const fem::GelVibration* vibration, const std::vector<std::shared_ptr<const fem::Compliance>>& elastic,
                 const StateVisitor& visit, const std::vector<fem::ContactShape>& shapes = {});

}  // namespace touchstone::sim
