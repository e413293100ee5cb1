#pragma once
// What effects of the press change: forces, places, heights.

#include <filesystem>
#include <span>
#include <vector>

#include "fem/elements/compliance.h"
#include "sim/plan/need.h"
#include "sim/plan/plan.h"
#include "sim/press/truth.h"
#include "sim/scene/scene.h"

namespace touchstone::sim {

/// Friction and elastic objects: the motion played with each the other way. `truths` are those of `plan`, `frames` the
/// ones that are compared.
void add_played_needs(const SceneSpec& scene, const Plan& plan, const fem::Compliance& gel,
                      std::span<const Truth> truths, std::span<const int> frames, const std::filesystem::path& cache,
                      SceneNeeds& needs);

/// Finite strain: each object that touches in `hardest`, alone, led to its pose there from where it just touches above
/// or below it, by both theories on one mesh (see NeedSettings::finite_edges); the largest changes. An elastic object's
/// own compliance is in the cache.
void add_finite_strain_need(const SceneSpec& scene, const Plan& plan, const Truth& hardest, double edges,
                            const std::filesystem::path& cache, SceneNeeds& needs);

}  // namespace touchstone::sim
