#pragma once
// Seconds that scenes will take on this machine: what is counted and looked at, times rates.

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/progress.h"
#include "sim/cost/machine_rates.h"
#include "sim/cost/scene_look.h"
#include "sim/plan/plan.h"
#include "sim/scene/scene.h"

namespace touchstone::sim {

/// Seconds of one thread that an effect takes.
struct EffectCost {
  std::string effect;    ///< as Effect::name
  double once_s = 0.0;   ///< a scene
  double frame_s = 0.0;  ///< a frame
};

/// Seconds of one thread, by the stages of a run.
struct SceneCost {
  int frames = 0;
  double gel_s = 0.0;        ///< of the gel's set-up, by the rates' threads; 0 where the cache has it
  double set_up_s = 0.0;     ///< of what else is done once before the motion
  double mechanics_s = 0.0;  ///< a frame after the first, one after the other
  double camera_s = 0.0;     ///< once a scene
  double picture_s = 0.0;    ///< a frame, in any order
  std::vector<EffectCost> effects;
  std::string light;                 ///< how pictures are lit, for people
  std::vector<std::string> unknown;  ///< what isn't in the seconds, or isn't known well, for people
};

/// Counts and looks (look_at_scene), for some seconds. Needs (`accuracy`) are apart: the plan has them already.
/// @throws Error as play_motion and SceneView
SceneCost predict_scene(const SceneSpec& scene, const Plan& plan, const MachineRates& rates,
                        const std::filesystem::path& cache);
/// The same from what was seen: `gel_s` is gel_setup_seconds', nothing if it isn't known; `newton_operations`
/// gel_factorisation_operations', where the plan has finite strain; `elastic_s` of elastic objects. Pure.
SceneCost scene_cost(const SceneSpec& scene, const Plan& plan, const SceneLook& look, const MachineRates& rates,
                     std::optional<double> gel_s, double newton_operations, double elastic_s);

/// Seconds on the clock of a run's stages, with the rates' threads.
struct RunCost {
  double gel_s = 0.0;
  double mechanics_s = 0.0;
  double cameras_s = 0.0;
  double frames_s = 0.0;
  int frames = 0;
  std::vector<std::string> unknown;  ///< each once

  double set_up_s() const { return gel_s + cameras_s; }
  double in_all_s() const { return gel_s + mechanics_s + cameras_s + frames_s; }
};

/// Of scenes with one gel, as `generate` runs them.
RunCost run_cost(std::span<const SceneCost> scenes, const MachineRates& rates);

/// "about 4 min 10 s: 35 s set-up, 240 frames at 0.9 s"
std::string in_words(const RunCost& cost);
/// "0.3 ms", "12 s", "3 min 05 s", "2 h 10 min"
std::string seconds_in_words(double seconds);

}  // namespace touchstone::sim
