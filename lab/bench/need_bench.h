#pragma once
// Does the plan leave out what may be left out, and nothing else? Scenes drawn at random over devices, objects and
// presses, planned by need and looked at closely.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/progress.h"
#include "sim/need/scene_needs.h"
#include "sim/scene/scene.h"

namespace touchstone::lab {

/// A scene with the words for it.
struct NeedTrial {
  std::string what;
  sim::SceneSpec scene;
};

/// The `index`-th scene of a seed: a shipped device and object (smooth, sharp, textured, soft), pressed 2 to 20 % of
/// the gel's thickness deep beside its middle, dragged in two of three. A pure function of its arguments.
/// @param scenes the folder of shipped files
/// @throws Error if the object can't be held against the gel there
NeedTrial need_trial(const std::filesystem::path& scenes, std::uint64_t seed, int index);

/// One effect of a scene as the plan measured it and as a closer look found it, over what is allowed: the largest over
/// the units.
struct NeedOutcome {
  std::string effect;
  bool on = false;       ///< by the plan
  double planned = 0.0;  ///< of what is allowed
  double closely = 0.0;
  std::string note;  ///< why it couldn't be measured
};

/// All effects of a scene.
struct NeedRun {
  std::vector<NeedOutcome> effects;
  std::string failure;  ///< of a scene that can't be simulated
  double plan_s = 0.0;
  double close_s = 0.0;
};

/// Plans the scene by what `first` finds with the default accuracy, and looks at it as `close` says.
NeedRun run_need_trial(const NeedTrial& trial, const sim::NeedSettings& first, const sim::NeedSettings& close,
                       const std::filesystem::path& cache, const Progress& progress = {});

/// How often the plan was right.
struct NeedSummary {
  int left_out = 0;     ///< effects
  int rightly_out = 0;  ///< which change at most what is allowed
  int switched_on = 0;  ///< effects
  int rightly_on = 0;   ///< which change more than a third of it
  int not_measured = 0;
};
/// Over all effects of all runs; one that fails has none.
NeedSummary summarise(const std::vector<NeedRun>& runs);

}  // namespace touchstone::lab
