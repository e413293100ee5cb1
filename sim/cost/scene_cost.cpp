#include "sim/cost/scene_cost.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "fem/elements/compliance_file.h"
#include "fem/error/compliance_cache.h"
#include "sim/cost/setup_cost.h"
#include "sim/press/gel_setup.h"

namespace touchstone::sim {
namespace {

/// Factorisations of a part of a press at finite strain: one for a fiftieth of the thickness, two for a tenth.
constexpr double kNewtonSteps = 1.5;

/// The gel, if it is in the cache and sound.
std::shared_ptr<const fem::Compliance> cached_gel(const DeviceSpec& device, const std::filesystem::path& cache) {
  std::error_code ignored;
  if (cache.empty() || !std::filesystem::exists(fem::compliance_file(cache, gel_key(device)), ignored)) return nullptr;
  return set_up_gel(device, cache);
}

}  // namespace

SceneCost scene_cost(const SceneSpec& scene, const Plan& plan, const SceneLook& look, const MachineRates& rates,
                     std::optional<double> gel_s, double newton_operations, double elastic_s) {
  SceneCost cost;
  cost.frames = scene.motion.frame_count();
  cost.light = look.light.how;
  const auto add = [&](const std::string& name, double once_s, double frame_s) {
    for (EffectCost& one : cost.effects) {
      if (one.effect != name) continue;
      one.once_s += once_s;
      one.frame_s += frame_s;
      return;
    }
    cost.effects.push_back({name, once_s, frame_s});
  };

  if (gel_s) {
    cost.gel_s = *gel_s;
  } else {
    cost.unknown.push_back("the gel's set-up: its mesh is found by its error");
  }
  if (plan.elastic_object) {
    cost.set_up_s += elastic_s;
    add("elastic object", elastic_s, 0.0);
  }
  if (plan.inertia) cost.unknown.push_back("the gel's modes");
  cost.mechanics_s = look.states * look.state_s;
  add("gel mechanics", cost.gel_s, cost.mechanics_s);
  if (plan.finite_strain) {
    const double newton_s = kNewtonSteps * look.newton_parts * newton_operations * rates.newton_s;
    cost.effects.back().frame_s = 0.0;
    cost.mechanics_s = newton_s;
    add("finite strain", 0.0, newton_s);
  }
  if (!look.pressed) {
    cost.unknown.push_back(
        "what is pressed: the gel isn't set up yet, so light was looked at before a gel at rest, and presses and the "
        "fine contact aren't in the seconds");
  }
  if (plan.events) cost.unknown.push_back("events");

  if (plan.fine_relief) {
    add("fine relief", look.deepest_relief_s, look.moments * look.relief_s);
    cost.camera_s += look.deepest_relief_s;
    cost.picture_s += look.moments * look.relief_s;
  }
  const auto picture = [&](const std::string& name, double once_s, double frame_s) {
    add(name, once_s, frame_s);
    cost.camera_s += once_s;
    cost.picture_s += frame_s;
  };
  if (plan.camera && scene.outputs.light()) {
    const bool direct = look.light.how.starts_with("direct light");
    const std::string light = direct ? "direct light" : plan.shared_paths ? "shared paths" : "camera and renderer";
    picture(light, look.light.set_up_s, look.light.moment_s);
    if (look.moments > 1.0) {
      picture(plan.motion_blur ? "motion blur" : "rolling shutter", 0.0, (look.moments - 1.0) * look.light.moment_s);
    }
    if (plan.auto_exposure || plan.auto_white_balance) {
      picture(plan.auto_exposure ? "auto exposure" : "auto white balance", cost.frames * look.light.metering_s, 0.0);
    }
    picture("sensor noise", 0.0, look.develop_s);
  }
  if (look.pixel_truth_s > 0.0) picture("truth of pixels", 0.0, look.pixel_truth_s);
  cost.picture_s += look.height_s + look.files_s;
  return cost;
}

SceneCost predict_scene(const SceneSpec& scene, const Plan& plan, const MachineRates& rates,
                        const std::filesystem::path& cache) {
  const std::shared_ptr<const fem::Compliance> gel = cached_gel(scene.device, cache);
  double elastic_s = 0.0;
  if (plan.elastic_object) {
    for (const MovedObject& moved : moved_objects(scene)) {
      if (moved.object.elastic) elastic_s += elastic_setup_seconds(moved.object, rates);
    }
  }
  return scene_cost(scene, plan, look_at_scene(scene, plan, gel.get(), cache), rates,
                    gel_setup_seconds(scene.device, rates, cache),
                    plan.finite_strain ? gel_factorisation_operations(scene.device) : 0.0, elastic_s);
}

RunCost run_cost(std::span<const SceneCost> scenes, const MachineRates& rates) {
  RunCost cost;
  // Scenes are played side by side, each by one thread; the longest one may go on alone.
  double mechanics_s = 0.0, longest_s = 0.0;
  for (const SceneCost& scene : scenes) {
    cost.frames += scene.frames;
    cost.gel_s = std::max(cost.gel_s, scene.gel_s);
    const double played_s = scene.set_up_s + (scene.frames - 1) * scene.mechanics_s;
    mechanics_s += played_s;
    longest_s = std::max(longest_s, played_s);
    cost.cameras_s += scene.camera_s / rates.speed_up;
    cost.frames_s += scene.frames * scene.picture_s / rates.speed_up;
    for (const std::string& one : scene.unknown) {
      if (std::find(cost.unknown.begin(), cost.unknown.end(), one) == cost.unknown.end()) cost.unknown.push_back(one);
    }
  }
  cost.mechanics_s = std::max(longest_s, mechanics_s / rates.speed_up);
  return cost;
}

std::string seconds_in_words(double seconds) {
  if (seconds < 1e-3) return fmt::format("{:.2g} ms", 1e3 * seconds);
  if (seconds < 0.0995) return fmt::format("{:.0f} ms", 1e3 * seconds);
  if (seconds < 9.95) return fmt::format("{:.1f} s", seconds);
  const auto whole = std::llround(std::min(seconds, 1e9));
  if (whole < 60) return fmt::format("{} s", whole);
  if (whole < 3600) return fmt::format("{} min {:02} s", whole / 60, whole % 60);
  return fmt::format("{} h {:02} min", whole / 3600, whole / 60 % 60);
}

std::string in_words(const RunCost& cost) {
  const double each_s = (cost.mechanics_s + cost.frames_s) / std::max(1, cost.frames);
  return fmt::format("about {}: {} set-up, {} frames at {}", seconds_in_words(cost.in_all_s()),
                     seconds_in_words(cost.set_up_s()), cost.frames, seconds_in_words(each_s));
}

}  // namespace touchstone::sim
