#pragma once
// The states of a motion in which effects change most.

#include <filesystem>
#include <span>
#include <vector>

#include "fem/elements/compliance.h"
#include "sim/plan/plan.h"
#include "sim/press/truth.h"
#include "sim/scene/scene.h"

namespace touchstone::sim {

/// N, of the object that is pressed most.
double strongest_force(const fem::PressState& state);

/// Frames, rising: the one in which an object's force is largest, the one in which one is sheared most, and the last
/// one that touches. None where nothing touches.
std::vector<int> hard_frames(std::span<const Truth> truths);

/// The motion's truth as `plan` has it, quasi-static.
std::vector<Truth> play_for_need(const SceneSpec& scene, const Plan& plan, const fem::Compliance& gel,
                                 const std::filesystem::path& cache);

}  // namespace touchstone::sim
