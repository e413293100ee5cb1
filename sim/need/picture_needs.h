#pragma once
// What effects of the light and of the seen surface change in pictures.

#include <cstdint>
#include <span>

#include "fem/elements/compliance.h"
#include "sim/need/scene_needs.h"
#include "sim/plan/need.h"
#include "sim/plan/plan.h"
#include "sim/press/truth.h"
#include "sim/scene/light_limits.h"
#include "sim/scene/scene.h"

namespace touchstone::sim {

/// From a seed to one that shares no random numbers with it.
inline constexpr std::uint64_t kOtherSeed = 0x9e3779b97f4a7c15;

/// Interreflection, fine relief and diffraction: some pixels of the states `frames` of `truths` (those of `plan`),
/// traced with each the other way, from the same random numbers and twice from others, so that what differs is free of
/// their noise on the mean. Pixels are drawn from those that see the contact, and what is within half of its radius of
/// it. Of a device with a background both pictures have what it adds to them. Where pixels are traced one by one, the
/// noise that `limits` leave in a still picture of them is kMorePaths.
/// @pre the plan has a camera
void add_picture_needs(const SceneSpec& scene, const Plan& plan, const fem::Compliance& gel,
                       std::span<const Truth> truths, std::span<const int> frames, const NeedSettings& settings,
                       const LightLimits& limits, SceneNeeds& needs);

}  // namespace touchstone::sim
