#include <spdlog/spdlog.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <span>

#include "apps/command.h"
#include "apps/plan_check.h"
#include "apps/progress_bar.h"
#include "core/error.h"
#include "core/yaml_reader.h"
#include "datasets/jobs/prepared_job.h"
#include "datasets/jobs/scene_plan.h"
#include "datasets/sets/drawn_needs.h"
#include "datasets/sets/job_cost.h"
#include "datasets/sets/planned_draw.h"
#include "lab/studies/study_plan.h"
#include "sim/cost/scene_cost.h"
#include "sim/press/gel_plan.h"
#include "sim/press/linear_range.h"

namespace touchstone::apps {
namespace {

/// `cost` may be null: then no seconds are printed.
void print_plan(const sim::Plan& plan, const sim::SceneCost* cost) {
  std::size_t widest = 6;
  for (const sim::Effect& effect : plan.effects) widest = std::max(widest, effect.name.size());
  const auto seconds = [&](const std::string& once, const std::string& frame) {
    return cost == nullptr ? std::string() : fmt::format("{:>11}  {:>11}  ", once, frame);
  };
  fmt::print("{:<{}}  {:<3}  {}{}\n", "effect", widest, "on", seconds("once", "a frame"), "why (cost)");
  for (const sim::Effect& effect : plan.effects) {
    std::string once, frame;
    if (cost != nullptr) {
      for (const sim::EffectCost& one : cost->effects) {
        if (one.effect != effect.name) continue;
        if (one.once_s > 0.0) once = sim::seconds_in_words(one.once_s);
        if (one.frame_s > 0.0) frame = sim::seconds_in_words(one.frame_s);
      }
    }
    fmt::print("{:<{}}  {:<3}  {}{} ({})\n", effect.name, widest, effect.on ? "yes" : "no", seconds(once, frame),
               effect.why, effect.cost);
  }
  for (const std::string& warning : plan.warnings) spdlog::warn("{}", warning);
}

bool equal(const sim::Plan& a, const sim::Plan& b) {
  return a.warnings == b.warnings && std::equal(a.effects.begin(), a.effects.end(), b.effects.begin(), b.effects.end(),
                                                [](const sim::Effect& x, const sim::Effect& y) {
                                                  return x.name == y.name && x.on == y.on && x.why == y.why &&
                                                         x.cost == y.cost;
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

/// The plan of one of several things that are simulated, unless it's that of the one before.
void print_next(const std::string& title, const sim::Plan& plan, const sim::Plan* before,
                const sim::SceneCost* cost = nullptr) {
  const bool as_before = before != nullptr && equal(*before, plan);
  fmt::print("{}{}{}\n", as_before ? "" : "\n", title, as_before ? ": as above" : "");
  if (!as_before) print_plan(plan, cost);
}

void print_seconds(const sim::RunCost& cost, const sim::MachineRates& rates) {
  fmt::print("\non {} thread{} of this machine: {}\n", rates.threads, rates.threads == 1 ? "" : "s",
             sim::in_words(cost));
  if (rates.threads > 1) fmt::print("the columns above are seconds of one thread\n");
  for (const std::string& one : cost.unknown) fmt::print("not known: {}\n", one);
}

/// What `predict` gives, with the seconds of this machine; nothing where they can't be had, which is said.
template <typename Predict>
auto predicted(const GlobalOptions& global, const Predict& predict)
    -> std::optional<decltype(predict(sim::MachineRates(), Progress()))> {
  try {
    ProgressBar bar(global.quiet);
    return predict(sim::machine_rates(global.threads, global.cache, bar.listener()), bar.listener());
  } catch (const std::exception& error) {
    spdlog::warn("its seconds aren't known: {}", error.what());
    return std::nullopt;
  }
}

void print_gel(const std::string& title, const sim::DeviceSpec& device, const GlobalOptions& global) {
  fmt::print("\n{}{}", title, describe(sim::plan_gel(device, global.cache)));
}

/// What is printed beside the plan itself.
struct Asked {
  bool linear_range = false;
  bool check = false;
  bool seconds = true;
};

void plan_scene(const std::filesystem::path& file, const Asked& asked, const GlobalOptions& global) {
  const sim::SceneSpec scene = sim::read_scene(file);
  sim::Plan planned;
  {
    ProgressBar bar(global.quiet);
    planned = datasets::plan_scene(scene, global.cache, bar.listener());
  }
  std::optional<sim::SceneCost> cost;
  std::optional<sim::RunCost> all;
  sim::MachineRates rates;
  if (asked.seconds) {
    cost = predicted(global, [&](const sim::MachineRates& measured, const Progress&) {
      rates = measured;
      return sim::predict_scene(scene, planned, rates, global.cache);
    });
    if (cost) all = sim::run_cost(std::span(&*cost, 1), rates);
  }
  print_plan(planned, cost ? &*cost : nullptr);
  if (all) print_seconds(*all, rates);
  print_gel("", scene.device, global);
  if (asked.check) print_plan_check(scene, planned, global);
  if (asked.linear_range) print_linear_range(scene, global);
}

void plan_job(const std::filesystem::path& file, const Asked& asked, const GlobalOptions& global) {
  datasets::PreparedJob job = datasets::prepare_job(file);
  {
    ProgressBar bar(global.quiet);
    datasets::plan_by_need(job, global.cache, bar.listener());
  }
  fmt::print("job {}: {} scenes, {} samples\n", job.job.name, job.scenes.size(), job.samples);
  std::optional<std::vector<sim::SceneCost>> costs;
  sim::MachineRates rates;
  if (asked.seconds) {
    costs = predicted(global, [&](const sim::MachineRates& measured, const Progress& progress) {
      rates = measured;
      return datasets::scene_costs(job, rates, global.cache, progress);
    });
  }
  const sim::Plan* before = nullptr;
  for (std::size_t i = 0; i < job.scenes.size(); ++i) {
    const datasets::PreparedScene& scene = job.scenes[i];
    print_next(
        fmt::format("{} ({}, {} samples)", scene.entry.name, datasets::name_of(scene.entry.split), scene.samples),
        scene.plan, before, costs ? &(*costs)[i] : nullptr);
    before = &scene.plan;
  }
  if (costs) print_seconds(sim::run_cost(*costs, rates), rates);
  print_gel("", job.scenes.front().spec.device, global);
  if (asked.linear_range) print_linear_range(job.scenes.front().spec, global);
}

void plan_draw(const std::filesystem::path& file, const Asked& asked, const GlobalOptions& global) {
  datasets::PreparedDraw draw = datasets::prepare_draw(file);
  std::vector<datasets::NeededDraw> needed;
  {
    ProgressBar bar(global.quiet);
    needed = datasets::plan_by_need(draw, global.cache, bar.listener());
  }
  const bool by_need = !needed.empty();
  if (!by_need) {
    for (datasets::PlannedDraw& one : datasets::planned_draws(draw)) {
      sim::Plan plan = sim::make_plan(one.scene);
      needed.push_back({std::move(one), std::move(plan)});
    }
  }
  const std::size_t objects = draw.job.draw.objects.size();
  fmt::print("job {}: draws {} samples; units: {}, objects: {}, files: {}\n", draw.job.name, draw.job.samples,
             draw.job.draw.units.count, objects, draw.blocks.size());
  fmt::print("{}", by_need
                       ? "Of each object its hardest sample is planned. What one of them calls for all are "
                         "simulated with; friction always.\n"
                       : "Of each object its first sample is planned. Switches are those of every job that draws.\n");
  for (std::size_t k = 0; k < needed.size(); ++k) {
    const datasets::PlannedDraw& one = needed[k].draw;
    print_next(fmt::format("{} (sample {}, unit {})", one.object, one.sample, one.unit), needed[k].plan,
               k == 0 ? nullptr : &needed[k - 1].plan);
  }
  if (by_need) fmt::print("\nAll samples: {}\n", datasets::in_words(draw.effects));
  if (needed.size() < objects) {
    fmt::print("\n{} of the objects are in none of the samples that were searched\n", objects - needed.size());
  }
  const datasets::PlannedDraw& first = needed.front().draw;
  if (first.by_maps) {
    fmt::print("\nPictures are made from maps of what touches the milky gel; the plan is of the mechanics alone.\n");
  }
  if (needed.front().plan.scattering && first.scene.device.coating) {
    fmt::print(
        "\nThe gel is milky under a coating: pictures are made from maps of it where these are found to be good "
        "enough, else by path tracing.\n");
  }
  if (asked.seconds) {
    sim::MachineRates rates;
    const auto all = predicted(global, [&](const sim::MachineRates& measured, const Progress& progress) {
      rates = measured;
      return datasets::draw_cost(draw, rates, global.cache, progress);
    });
    if (all) print_seconds(*all, rates);
  }
  print_gel(fmt::format("unit {}'s ", first.unit), first.scene.device, global);
  if (asked.linear_range) print_linear_range(first.scene, global);
}

void plan_study(const std::filesystem::path& file, bool linear_range, const GlobalOptions& global) {
  const lab::StudySpec study = lab::read_study(file);
  const std::vector<lab::StudyScene> scenes = lab::study_scenes(study);
  if (linear_range && scenes.empty()) fail("{}: --linear-range: the study presses nothing", file.string());
  std::vector<sim::Plan> plans;
  for (const lab::StudyScene& one : scenes) plans.push_back(sim::make_plan(one.scene));
  fmt::print("study {}: {} designs\n", study.name, lab::design_count(study));
  if (scenes.empty()) {
    fmt::print("by formula alone: nothing is simulated\n");
    return;
  }
  fmt::print("The device is planned as its file has it. Switches are the study's own.\n");
  for (std::size_t k = 0; k < scenes.size(); ++k) {
    print_next(scenes[k].what, plans[k], k == 0 ? nullptr : &plans[k - 1]);
  }
  print_gel("", scenes.front().scene.device, global);
  if (linear_range) print_linear_range(scenes.front().scene, global);
}

/// A kind of file that doesn't say what will be simulated: a key that only it has, and what it is.
struct UnplannedFile {
  const char* key;
  const char* words;
};
constexpr UnplannedFile kUnplanned[] = {
    {"gel", "it is a device's file and doesn't say what presses it"},
    {"shape", "it is an object's file and doesn't say what it is pressed on"},
    {"keys", "it is a motion's file and doesn't say what is moved, and on what"},
    {"unknowns", "it is a fit's file; `touchstone fit` simulates its presses again and again with other numbers"},
    {"lump", "it is a palpation's file; `touchstone validate vhs.palpation` presses its lumps by a law of their own"},
};

void plan(const std::filesystem::path& file, const Asked& asked, const GlobalOptions& global) {
  const YamlReader in = YamlReader::open(file);
  if (asked.check && (in.has("draw") || in.has("scenes") || in.has("kind") || in.has("vary"))) {
    fail("{}: --check takes a scene's file", file.string());
  }
  if (in.has("draw")) return plan_draw(file, asked, global);
  if (in.has("scenes")) return plan_job(file, asked, global);
  if (in.has("kind") || in.has("vary")) return plan_study(file, asked.linear_range, global);
  for (const UnplannedFile& kind : kUnplanned) {
    if (!in.has(kind.key) || in.has("object")) continue;  // a scene with a key too many is refused as a scene
    fail("{}: {}; `touchstone plan` takes scenes, jobs of scenes, jobs that draw, and studies", file.string(),
         kind.words);
  }
  plan_scene(file, asked, global);
}

}  // namespace

void add_plan_command(CLI::App& app, const GlobalOptions& global, Action& action) {
  CLI::App* command =
      app.add_subcommand("plan", "Show which effects a scene, a job or a study calls for, why, and their cost");
  auto file = std::make_shared<std::filesystem::path>();
  command->add_option("SCENE|JOB|STUDY", *file, "Scene file, job file of either kind, or study file")->required();
  auto asked = std::make_shared<Asked>();
  command->add_flag("--linear-range", asked->linear_range,
                    "Also press the (first) scene's object by finite strain, and tell how far the forces of linear "
                    "elasticity are off and what each costs (half a minute and more)");
  command->add_flag("--check", asked->check,
                    "Also simulate the scene's hardest states closely, with each effect the other way, and print what "
                    "that changes beside what the plan goes by (a scene's file; a minute and more)");
  command->add_flag("!--no-seconds", asked->seconds,
                    "Leave out the seconds that it takes on this machine, which are found in some seconds");
  command->callback(
      [&action, &global, file, asked] { action = [&global, file, asked] { plan(*file, *asked, global); }; });
}

}  // namespace touchstone::apps
