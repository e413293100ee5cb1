#pragma once
// What one frame of a scene takes, from a look at it: a motion of few frames is played, some pixels are seen.

#include <filesystem>

#include "fem/elements/compliance.h"
#include "sim/cost/light_look.h"
#include "sim/plan/plan.h"
#include "sim/scene/scene.h"

namespace touchstone::sim {

/// Seconds of one thread for one of each, and how many of each there are in a frame.
struct SceneLook {
  bool pressed = false;           ///< false: the gel isn't set up yet, and was looked at as nothing presses it
  double states = 1.0;            ///< pressed states a frame
  double state_s = 0.0;           ///< by linear elasticity, with what the first frame takes
  double newton_parts = 0.0;      ///< parts a frame of a press at finite strain, each no longer than its longest
  double moments = 1.0;           ///< at which a frame's light is computed, as a mean
  double load = 0.0;              ///< part of the deepest's contact that there is at one of them, as a mean
  double relief_s = 0.0;          ///< of the fine contact at one moment, as a mean
  double deepest_relief_s = 0.0;  ///< of the deepest's
  LightLook light;                ///< where pictures are asked for
  double develop_s = 0.0;         ///< a frame's imager
  double pixel_truth_s = 0.0;     ///< of a frame, where it's asked for
  double height_s = 0.0;          ///< likewise
  double files_s = 0.0;           ///< of writing a frame's pictures
};

/// Looks with one thread, for one to three seconds. `gel` is null where it isn't set up. Elastic objects are set up,
/// and kept in the cache. @throws Error as play_motion and SceneView
SceneLook look_at_scene(const SceneSpec& scene, const Plan& plan, const fem::Compliance* gel,
                        const std::filesystem::path& cache);

/// The scene's motion in at most `most` frames or one a key: each key takes its part of them.
/// @returns by how much faster it goes
double shorten(MotionSpec& motion, int most);

}  // namespace touchstone::sim
