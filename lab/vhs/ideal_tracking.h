#pragma once
// What an ideal tracker would measure of a motion: for studies of a design, whose forces then are as good as its
// mechanics and its view allow, at seconds instead of minutes of pictures.

#include <cstdint>
#include <string>

#include "fem/elements/compliance.h"
#include "lab/vhs/vhs_experiment.h"
#include "sim/scene/scene.h"

namespace touchstone::lab {

/// Plays the scene's motion and gives where the centres of the device's beads appear through plate and gel, all found.
/// @param noise_px standard deviation that each coordinate has, normal and of its own; `seed` draws it
/// @throws Error if the device has no beads or no camera, a bead can't be seen, or as sim::play_motion
TrackedSequence track_ideally(const std::string& name, const sim::SceneSpec& scene, const fem::Compliance& gel,
                              double noise_px = 0.0, std::uint64_t seed = 0);

}  // namespace touchstone::lab
