#pragma once
// Which effects a job that draws simulates, where it or its device states an accuracy.

#include <filesystem>
#include <string>
#include <vector>

#include "core/progress.h"
#include "datasets/sets/planned_draw.h"
#include "sim/plan/plan.h"

namespace touchstone::datasets {

/// The hardest sample of an object, planned by what effects change in it.
struct NeededDraw {
  PlannedDraw draw;
  sim::Plan plan;
};

/// Measures what effects change in the hardest sample of each object (sim::plan_by_need) and switches in
/// `prepared.effects` those on that any of them calls for: a data set's samples are all simulated alike. Effects that
/// none calls for are switched off. Empty, and nothing is switched, where no accuracy is stated. Kept in the cache by
/// the contents of all files of the job. A pure function of the job.
/// @throws Error as planned_draws() and sim::plan_by_need
std::vector<NeededDraw> plan_by_need(PreparedDraw& prepared, const std::filesystem::path& cache,
                                     const Progress& progress = {});

/// As "finite strain on, fine relief on, interreflection off, diffraction off": what plan_by_need() has switched.
std::string in_words(const sim::EffectSwitches& effects);

}  // namespace touchstone::datasets
