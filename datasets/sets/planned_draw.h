#pragma once
// What a job that draws will simulate, for `touchstone plan`.

#include <cstdint>
#include <string>
#include <vector>

#include "datasets/jobs/drawn_touch.h"
#include "sim/scene/scene.h"

namespace touchstone::datasets {

/// Which sample stands for all that press the same object: the first one, or the one that is to press hardest (of the
/// first ten thousand).
enum class StandsFor : std::uint8_t { first, hardest };

/// A sample that stands for all that press the same object.
struct PlannedDraw {
  std::string object;  ///< the file's name without its ending
  std::int64_t sample = 0;
  int unit = 0;
  sim::SceneSpec scene;  ///< as the unit's sensor plays and shows it, with the job's outputs
  bool by_maps = false;  ///< its pictures are maps of a milky gel, of which the scene says nothing
};

/// For each object of the job, in its order, a sample that presses it. Objects that no sample presses, or none of the
/// first ten thousand, are left out. @throws Error with file and line for a unit or object that can't be had
std::vector<PlannedDraw> planned_draws(const PreparedDraw& prepared, StandsFor which = StandsFor::first);

}  // namespace touchstone::datasets
