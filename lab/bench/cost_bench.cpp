#include "lab/bench/cost_bench.h"

#include <tbb/global_control.h>
#include <unistd.h>

#include "core/error.h"
#include "core/sha256.h"
#include "sim/cost/setup_cost.h"
#include "sim/cost/work_clock.h"
#include "sim/files/image_file.h"
#include "sim/press/elastic_object.h"
#include "sim/press/gel_setup.h"
#include "sim/press/play_motion.h"
#include "sim/sensor/virtual_camera.h"

namespace touchstone::lab {
namespace {

/// The gel, predicted and set up where this run hasn't yet; else as it was then.
std::shared_ptr<const fem::Compliance> timed_gel(const sim::DeviceSpec& device, const sim::MachineRates& rates,
                                                 const std::filesystem::path& cache, GelSeconds& gels,
                                                 CostPair& seconds) {
  // Gels that differ in their modulus are made from one.
  sim::DeviceSpec relative = device;
  if (relative.gel.layers.empty()) relative.gel.youngs_modulus_MPa = 1.0;
  const std::string key = sim::gel_key(relative);
  const auto known = gels.find(key);
  if (known == gels.end()) {
    seconds.predicted_s = sim::gel_setup_seconds(relative, rates, cache).value();
    const sim::WorkClock clock;
    sim::set_up_gel(relative, cache);
    seconds.measured_s = clock.seconds();
    gels[key] = seconds;
  } else {
    seconds = known->second;
  }
  return sim::set_up_gel(device, cache);
}

void simulate(const sim::SceneSpec& scene, const sim::Plan& plan, const fem::Compliance& gel, CostOutcome& outcome) {
  sim::WorkClock played;
  const auto elastic = sim::set_up_elastic_objects(scene, plan, {});
  const std::vector<sim::Truth> truths = sim::play_motion(scene, plan, gel, {}, nullptr, elastic);
  outcome.mechanics.measured_s = played.seconds();
  const sim::WorkClock made;
  const sim::VirtualCamera camera(scene, plan, gel, truths);
  outcome.camera.measured_s = made.seconds();
  outcome.light_then = camera.light_choice().reason;
  const std::filesystem::path file =
      std::filesystem::temp_directory_path() / fmt::format("touchstone-cost-{}.png", getpid());
  const sim::WorkClock drawn;
  for (const sim::Truth& truth : truths) {
    sim::write_png(file, camera.capture(truth).frame);
    sha256_of_file(file);
  }
  outcome.frames.measured_s = drawn.seconds();
  std::filesystem::remove(file);
}

}  // namespace

CostPair CostOutcome::in_all() const {
  CostPair all;
  for (const CostPair* one : {&gel, &mechanics, &camera, &frames}) {
    all.predicted_s += one->predicted_s;
    all.measured_s += one->measured_s;
  }
  return all;
}

CostOutcome run_cost_trial(const NeedTrial& trial, bool with_accuracy, const sim::MachineRates& rates,
                           const std::filesystem::path& cache, GelSeconds& gels) {
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  CostOutcome outcome;
  sim::SceneSpec scene = trial.scene;
  scene.outputs = {};
  if (!with_accuracy) scene.accuracy.reset();
  try {
    const auto gel = timed_gel(scene.device, rates, cache, gels, outcome.gel);
    sim::SceneNeeds needs;
    if (with_accuracy) {
      const sim::WorkClock clock;
      needs = sim::measure_needs(scene, *gel, {}, cache);
      outcome.needs_s = clock.seconds();
    }
    const sim::Plan plan = sim::make_plan(scene, needs);
    for (const sim::Effect& effect : plan.effects) {
      if (effect.on) outcome.on.push_back(effect.name);
    }
    const sim::WorkClock looking;
    const sim::SceneCost cost = sim::predict_scene(scene, plan, rates, cache);
    outcome.look_s = looking.seconds();
    const sim::RunCost run = sim::run_cost(std::span(&cost, 1), rates);
    outcome.light = cost.light;
    outcome.mechanics.predicted_s = run.mechanics_s;
    outcome.camera.predicted_s = run.cameras_s;
    outcome.frames.predicted_s = run.frames_s;
    simulate(scene, plan, *gel, outcome);
  } catch (const Error& error) {
    outcome.failure = error.what();
  }
  return outcome;
}

}  // namespace touchstone::lab
