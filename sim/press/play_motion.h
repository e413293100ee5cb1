#pragma once
// From a scene's motion to the truth of each frame.

#include <memory>
#include <vector>

#include "core/progress.h"
#include "fem/elements/compliance.h"
#include "fem/shapes/contact_shape.h"
#include "fem/vibration/vibration.h"
#include "sim/plan/plan.h"
#include "sim/press/elastic_object.h"
#include "sim/press/gel_setup.h"
#include "sim/press/truth.h"
#include "sim/scene/scene.h"

namespace touchstone::sim {

/// Plays a scene's motion from its start: one Truth a frame. Sequential, because friction and relaxation remember.
/// `vibration` is what set_up_vibration gives; without it vibrations are quasi-static: with it, over a key that
/// vibrates, the steady answer of the gel to a body that sticks where it touches is added to the press of the mean
/// motion. `elastic` is what set_up_elastic_objects gives. `shapes`: coarse_contact_shape of each moved object, for who
/// plays many motions of the same; without them they're made.
/// @throws Error if a wanted force can't be met or the press leaves what the model can do
std::vector<Truth> play_motion(const SceneSpec& scene, const Plan& plan, const fem::Compliance& gel,
                               const Progress& progress = {}, const fem::GelVibration* vibration = nullptr,
                               const std::vector<std::shared_ptr<const fem::Compliance>>& elastic = {},
                               const std::vector<fem::ContactShape>& shapes = {});

}  // namespace touchstone::sim
