#pragma once
// What direct light can't draw.

#include <string>

#include "render/direct/light_field.h"
#include "render/scene/scene.h"

namespace touchstone::render {

/// The reason why DirectRenderer would refuse this scene, empty if it wouldn't. For a plan that looks for the cheapest
/// renderer; that interreflection may be left out is for the plan to show. `bounces_are_carried`: the renderer has them
/// (DirectRenderer::set_bounced_light), so that a scene may ask for interreflection.
std::string unfit_for_direct(const LightField& field, const Scene& scene, bool bounces_are_carried = false);

}  // namespace touchstone::render
