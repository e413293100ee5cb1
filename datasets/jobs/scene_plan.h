#pragma once

#include <filesystem>

#include "core/progress.h"
#include "datasets/jobs/prepared_job.h"
#include "sim/plan/plan.h"
#include "sim/scene/scene.h"

namespace touchstone::datasets {

/// The plan of a scene that was read from a file (sim::plan_by_need), kept in the cache by the contents of all files
/// that it names. Of the spec itself outputs, seed, places of start and the light's settings may have been changed
/// since.
/// @throws Error as sim::plan_by_need
sim::Plan plan_scene(const sim::SceneSpec& scene, const std::filesystem::path& cache, const Progress& progress = {});

/// The same for all scenes of a job. @throws Error likewise
void plan_by_need(PreparedJob& job, const std::filesystem::path& cache, const Progress& progress = {});

}  // namespace touchstone::datasets
