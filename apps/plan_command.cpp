#include <algorithm>
#include <memory>

#include "apps/command.h"
#include "apps/progress_bar.h"
#include "core/error.h"
#include "datasets/jobs/prepared_job.h"
#include "sim/press/gel_plan.h"
#include "sim/press/linear_range.h"

namespace touchstone::apps {
namespace {

void print_plan(const sim::Plan& plan) {
  std::size_t widest = 6;
  for (const sim::Effect& effect : plan.effects) widest = std::max(widest, effect.name.size());
  fmt::print("{:<{}}  {:<3}  {}\n", "effect", widest, "on", "why (cost)");
  for (const sim::Effect& effect : plan.effects) {
    fmt::print("{:<{}}  {:<3}  {} ({})\n", effect.name, widest, effect.on ? "yes" : "no", effect.why, effect.cost);
  }
}

bool equal(const sim::Plan& a, const sim::Plan& b) {
  return std::equal(a.effects.begin(), a.effects.end(), b.effects.begin(), b.effects.end(),
                    [](const sim::Effect& x, const sim::Effect& y) {
                      return x.name == y.name && x.on == y.on && x.why == y.why && x.cost == y.cost;
                    });
}

void print_linear_range(const sim::SceneSpec& scene, const GlobalOptions& global) {
  std::vector<fem::LinearRangeRow> rows;
  {
    ProgressBar bar(global.quiet);
    rows = sim::measure_linear_range(scene, global.cache, bar.listener());
  }
  fmt::print(
      "\nforces of linear elasticity beside finite strain's (neo-Hookean) on the same mesh, {} straight down in the "
      "gel's middle\n{:>8}  {:>8}  {:>9}  {:>9}  {:>7}  {:>10}  {:>10}\n",
      scene.object.name, "depth mm", "strain", "linear N", "finite N", "off %", "linear ms", "finite ms");
  for (const fem::LinearRangeRow& row : rows) {
    fmt::print("{:>8.3f}  {:>8.3f}  {:>9.4f}  {:>9.4f}  {:>+7.1f}  {:>10.2f}  {:>10.0f}\n", row.depth,
               row.largest_strain, row.linear_force, row.finite_force, 100.0 * row.difference(),
               1e3 * row.linear_seconds, 1e3 * row.finite_seconds);
  }
  if (rows.size() < std::size(fem::kRangeDepths)) {
    fmt::print("deeper, one of the two has no answer\n");
  }
  fmt::print("truth keeps the largest strain of each frame: look up there what its forces may be off\n");
}

void plan(const std::filesystem::path& file, bool linear_range, const GlobalOptions& global) {
  const std::filesystem::path& cache = global.cache;
  if (!datasets::is_job_file(file)) {
    const sim::SceneSpec scene = sim::read_scene(file);
    print_plan(sim::make_plan(scene));
    fmt::print("\n{}", describe(sim::plan_gel(scene.device, cache)));
    if (linear_range) print_linear_range(scene, global);
    return;
  }
  const datasets::PreparedJob job = datasets::prepare_job(file);
  fmt::print("job {}: {} scenes, {} samples\n", job.job.name, job.scenes.size(), job.samples);
  const datasets::PreparedScene* before = nullptr;
  for (const datasets::PreparedScene& scene : job.scenes) {
    const bool as_before = before != nullptr && equal(before->plan, scene.plan);
    if (!as_before) fmt::print("\n");
    fmt::print("{} ({}, {} samples){}\n", scene.entry.name, datasets::name_of(scene.entry.split), scene.samples,
               as_before ? ": as above" : "");
    if (!as_before) print_plan(scene.plan);
    before = &scene;
  }
  fmt::print("\n{}", describe(sim::plan_gel(job.scenes.front().spec.device, cache)));
  if (linear_range) print_linear_range(job.scenes.front().spec, global);
}

}  // namespace

void add_plan_command(CLI::App& app, const GlobalOptions& global, Action& action) {
  CLI::App* command = app.add_subcommand("plan", "Show which effects a scene or job calls for, why, and their cost");
  auto file = std::make_shared<std::filesystem::path>();
  command->add_option("SCENE|JOB", *file, "Scene or job file")->required();
  auto linear_range = std::make_shared<bool>(false);
  command->add_flag("--linear-range", *linear_range,
                    "Also press the (first) scene's object by finite strain, and tell how far the forces of linear "
                    "elasticity are off and what each costs (half a minute and more)");
  command->callback([&action, &global, file, linear_range] {
    action = [&global, file, linear_range] { plan(*file, *linear_range, global); };
  });
}

}  // namespace touchstone::apps
