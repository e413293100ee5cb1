#pragma once
// Seconds that a job will take on this machine.

#include <filesystem>

#include "core/progress.h"
#include "datasets/jobs/drawn_touch.h"
#include "datasets/jobs/prepared_job.h"
#include "sim/cost/scene_cost.h"

namespace touchstone::datasets {

/// Of each scene of a job. Scenes of one file are looked at once. @pre its plans are made (plan_by_need)
/// @throws Error as sim::predict_scene
std::vector<sim::SceneCost> scene_costs(const PreparedJob& job, const sim::MachineRates& rates,
                                        const std::filesystem::path& cache, const Progress& progress = {});

/// Of all samples of a job that draws, as RunCost of scenes: each object's first sample stands for all that press it, a
/// unit's set-up is the first one's. Pictures from maps of a milky gel aren't in it. @throws Error likewise
sim::RunCost draw_cost(const PreparedDraw& draw, const sim::MachineRates& rates, const std::filesystem::path& cache,
                       const Progress& progress = {});

}  // namespace touchstone::datasets
