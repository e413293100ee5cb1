#include "lab/bench/need_bench.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>

#include "core/error.h"
#include "core/random.h"
#include "core/seconds_since.h"
#include "core/units.h"
#include "lab/bench/bench_scene.h"
#include "sim/plan/change_units.h"
#include "sim/press/gel_setup.h"

namespace touchstone::lab {
namespace {

constexpr std::array<const char*, 8> kDevices = {
    "vhs",           "gelsight-flat", "gelsight-markers", "gelsight-dome",
    "gelsight-mini", "digit",         "chroma-compact",   "gelsight-portable"};
constexpr std::array<const char*, 12> kObjects = {
    "ball-2mm", "ball-4mm",   "ball-8mm",       "ball-12.7mm", "punch-2mm",        "probe-6mm",
    "egg",      "coin-penny", "cylinder-8.5mm", "print-60um",  "hexagon-silicone", "fingerprint"};
constexpr double kLeastDepth = 0.02;  // of the gel's thickness
constexpr double kMostDepth = 0.2;
constexpr double kFarthestPlace_mm = 1.5;
constexpr double kWorthIt = 1.0 / 3.0;  // of what is allowed

double over_allowed(const sim::Change& change) {
  const sim::Accuracy allowed;
  double most = 0.0;
  for (const sim::ChangeUnit& unit : sim::kChangeUnits) {
    most = std::max(most, (change.*unit.changed).value_or(0.0) / (allowed.*unit.allowed));
  }
  return most;
}

}  // namespace

NeedTrial need_trial(const std::filesystem::path& scenes, std::uint64_t seed, int index) {
  RandomStream random(seed, static_cast<std::uint64_t>(index), Purpose::kStudy);
  const auto one_of = [&](const auto& list) {
    return list[std::min(list.size() - 1,
                         static_cast<std::size_t>(random.uniform() * static_cast<double>(list.size())))];
  };
  const char* device_name = one_of(kDevices);
  const char* object_name = one_of(kObjects);
  const sim::DeviceSpec device = sim::read_device(scenes / "devices" / fmt::format("{}.yaml", device_name));
  BenchPresses presses;
  presses.object = read_yaml<sim::ObjectSpec>(scenes / "objects" / fmt::format("{}.yaml", object_name));
  sim::PressSpec spec;
  for (int a = 0; a < 2; ++a) spec.place_mm[a] = kFarthestPlace_mm * (2.0 * random.uniform() - 1.0);
  const double part = kLeastDepth * std::pow(kMostDepth / kLeastDepth, random.uniform());
  spec.depth_mm = part * device.gel.thickness_mm;
  const double angle = 2.0 * kPi * random.uniform();
  if (random.uniform() < 2.0 / 3.0)
    spec.drag_mm = *spec.depth_mm * Eigen::Vector2d(std::cos(angle), std::sin(angle)) / 3.0;
  presses.touch_mm = sim::first_touch(spec, presses.object, device.gel);
  NeedTrial trial{fmt::format("seed {} number {}: {} on {}, {}", seed, index, object_name, device_name, in_words(spec)),
                  bench_scene(device, presses, spec, seed + static_cast<std::uint64_t>(index))};
  trial.scene.accuracy.emplace();
  return trial;
}

NeedRun run_need_trial(const NeedTrial& trial, const sim::NeedSettings& first, const sim::NeedSettings& close,
                       const std::filesystem::path& cache, const Progress& progress) {
  NeedRun run;
  try {
    const auto gel = sim::set_up_gel(trial.scene.device, cache, progress);
    const auto begun = std::chrono::steady_clock::now();
    const sim::SceneNeeds needs = sim::measure_needs(trial.scene, *gel, first, cache, progress);
    run.plan_s = seconds_since(begun);
    const sim::Plan plan = sim::make_plan(trial.scene, needs);
    const auto between = std::chrono::steady_clock::now();
    const sim::SceneNeeds closely = sim::measure_needs(trial.scene, *gel, close, cache, progress);
    run.close_s = seconds_since(between);
    for (const sim::EffectNeed& need : needs) {
      const auto in_plan = std::find_if(plan.effects.begin(), plan.effects.end(),
                                        [&](const sim::Effect& one) { return one.name == need.effect; });
      if (in_plan == plan.effects.end()) continue;
      NeedOutcome outcome{need.effect, in_plan->on, 0.0, 0.0, need.note};
      const sim::Change* found = sim::change_of(closely, need.effect);
      if (need.change) outcome.planned = over_allowed(*need.change);
      if (found != nullptr) outcome.closely = over_allowed(*found);
      if (need.change && found == nullptr) outcome.note = "the closer look has no answer";
      run.effects.push_back(std::move(outcome));
    }
  } catch (const Error& error) {
    run.failure = error.what();
  }
  return run;
}

NeedSummary summarise(const std::vector<NeedRun>& runs) {
  NeedSummary sum;
  for (const NeedRun& run : runs) {
    for (const NeedOutcome& effect : run.effects) {
      if (!effect.note.empty()) {
        ++sum.not_measured;
      } else if (effect.on) {
        ++sum.switched_on;
        sum.rightly_on += effect.closely > kWorthIt;
      } else {
        ++sum.left_out;
        sum.rightly_out += effect.closely <= 1.0;
      }
    }
  }
  return sum;
}

}  // namespace touchstone::lab
