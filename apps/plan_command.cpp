#include <algorithm>
#include <memory>

#include "apps/command.h"
#include "core/error.h"
#include "lab/prepared_job.h"
#include "sim/gel_plan.h"

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

void plan(const std::filesystem::path& file, const std::filesystem::path& cache) {
  if (!lab::is_job_file(file)) {
    const sim::SceneSpec scene = sim::read_scene(file);
    print_plan(sim::make_plan(scene));
    fmt::print("\n{}", describe(sim::plan_gel(scene.device, cache)));
    return;
  }
  const lab::PreparedJob job = lab::prepare_job(file);
  fmt::print("job {}: {} scenes, {} samples\n", job.job.name, job.scenes.size(), job.samples);
  const lab::PreparedScene* before = nullptr;
  for (const lab::PreparedScene& scene : job.scenes) {
    const bool as_before = before != nullptr && equal(before->plan, scene.plan);
    if (!as_before) fmt::print("\n");
    fmt::print("{} ({}, {} samples){}\n", scene.entry.name, lab::name_of(scene.entry.split), scene.samples,
               as_before ? ": as above" : "");
    if (!as_before) print_plan(scene.plan);
    before = &scene;
  }
  fmt::print("\n{}", describe(sim::plan_gel(job.scenes.front().spec.device, cache)));
}

}  // namespace

void add_plan_command(CLI::App& app, const GlobalOptions& global, Action& action) {
  CLI::App* command = app.add_subcommand("plan", "Show which effects a scene or job calls for, why, and their cost");
  auto file = std::make_shared<std::filesystem::path>();
  command->add_option("SCENE|JOB", *file, "Scene or job file")->required();
  command->callback([&action, &global, file] { action = [&global, file] { plan(*file, global.cache); }; });
}

}  // namespace touchstone::apps
