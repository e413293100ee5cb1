#pragma once
// What a scene's light takes, from a look at it: some pixels are traced, some places of its light field computed.

#include <optional>
#include <span>
#include <string>

#include "fem/elements/compliance.h"
#include "sim/press/truth.h"
#include "sim/view/scene_view.h"

namespace touchstone::sim {

/// Seconds of one thread, without those of the fine contact.
struct LightLook {
  std::string how;          ///< which light it will be, for people
  double set_up_s = 0.0;    ///< of the scene's camera
  double moment_s = 0.0;    ///< of the light of a frame at one moment, as a mean over frames
  double metering_s = 0.0;  ///< a frame, of a camera that sets itself
};

/// Looks at the first and the deepest of `truths`; `relief` is the fine contact of the deepest. `moments`: at how many
/// of them a frame's light is computed; `load`: part of the deepest's contact that there is at one of them, as a mean;
/// `frames`: of the whole motion. Whether direct light
/// holds is judged on a coarse light field, and where it doesn't, the last of what is tried is taken to. `gel` is the
/// view's. Takes about a second. @pre the scene's pictures are asked for; there is a truth
LightLook look_at_light(const SceneView& view, const fem::Compliance& gel, std::span<const Truth> truths,
                        const std::optional<fem::ReliefAnswer>& relief, double moments, double load, int frames);

}  // namespace touchstone::sim
