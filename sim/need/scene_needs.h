#pragma once
// What each effect changes in a scene's hardest states, and the plan that follows from it.

#include <filesystem>
#include <memory>

#include "core/progress.h"
#include "fem/elements/compliance.h"
#include "sim/plan/need.h"
#include "sim/plan/plan.h"
#include "sim/scene/scene.h"

namespace touchstone::sim {

/// How closely effects are looked at.
struct NeedSettings {
  double finite_edges = 2.0;  ///< finite strain is tried on a mesh of up to so many times the device's edges, fine
                              ///< where it's touched alone; 1: on its own mesh; 0: not at all
  int pixels = 256;           ///< that see the contact or what is about it are traced, in each state
  int paths = 64;             ///< a pixel, twice, with other random numbers
};

/// A closer look, to hold the first one beside (`touchstone plan --check`): the device's own mesh, more pixels.
inline constexpr NeedSettings kCloseLook{1.0, 2500, 256};

/// Tries each effect the other way around the plan of fixed shares, in the motion's hardest states (hard_states.h):
/// friction and elastic objects by playing the motion, finite strain by one press to the hardest pose on a coarser
/// mesh, interreflection and fine relief by tracing some pixels. Relaxation, inertia, bands, translucent coatings,
/// motion blur and rolling shutter have closed forms in make_plan. What can't be had in the scene isn't in the result.
/// A pure function of its arguments, but for `cache`.
/// @throws Error as make_plan and play_motion
SceneNeeds measure_needs(const SceneSpec& scene, const fem::Compliance& gel, const NeedSettings& settings,
                         const std::filesystem::path& cache, const Progress& progress = {});

/// The plan by which a scene is simulated: make_plan() where no accuracy is stated. Where one is, with what effects
/// were measured to change, the gel being set up for that; that result is kept in the cache under `key`, which must
/// tell this scene from all others (empty: it isn't kept).
Plan plan_by_need(const SceneSpec& scene, const std::string& key, const std::filesystem::path& cache,
                  const Progress& progress = {});

}  // namespace touchstone::sim
