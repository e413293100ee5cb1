#include "datasets/sets/job_cost.h"

#include "datasets/sets/planned_draw.h"

namespace touchstone::datasets {

std::vector<sim::SceneCost> scene_costs(const PreparedJob& job, const sim::MachineRates& rates,
                                        const std::filesystem::path& cache, const Progress& progress) {
  std::vector<sim::SceneCost> costs;
  for (std::size_t i = 0; i < job.scenes.size(); ++i) {
    if (progress) progress("seconds", static_cast<std::int64_t>(i), static_cast<std::int64_t>(job.scenes.size()));
    const PreparedScene& scene = job.scenes[i];
    std::size_t like = 0;
    while (like < i && job.scenes[like].entry.scene != scene.entry.scene) ++like;
    costs.push_back(like < i ? costs[like] : sim::predict_scene(scene.spec, scene.plan, rates, cache));
    costs.back().frames = static_cast<int>(scene.samples);
  }
  return costs;
}

sim::RunCost draw_cost(const PreparedDraw& draw, const sim::MachineRates& rates, const std::filesystem::path& cache,
                       const Progress& progress) {
  const std::vector<PlannedDraw> planned = planned_draws(draw);
  std::vector<sim::SceneCost> costs;
  for (std::size_t i = 0; i < planned.size(); ++i) {
    if (progress) progress("seconds", static_cast<std::int64_t>(i), static_cast<std::int64_t>(planned.size()));
    sim::SceneCost cost = sim::predict_scene(planned[i].scene, sim::make_plan(planned[i].scene), rates, cache);
    if (planned[i].by_maps) cost.unknown.emplace_back("pictures from maps of a milky gel");
    // A sample is a whole motion with one picture, and samples are made side by side.
    cost.picture_s += cost.frames * cost.mechanics_s;
    cost.mechanics_s = 0.0;
    const auto many = static_cast<std::size_t>(draw.job.samples);
    cost.frames = static_cast<int>(many * (i + 1) / planned.size() - many * i / planned.size());
    cost.camera_s = i == 0 ? draw.job.draw.units.count * cost.camera_s : 0.0;
    costs.push_back(std::move(cost));
  }
  return sim::run_cost(costs, rates);
}

}  // namespace touchstone::datasets
