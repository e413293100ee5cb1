#include "sim/need/scene_needs.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "core/sha256.h"
#include "core/whole_file.h"
#include "sim/need/hard_states.h"
#include "sim/need/picture_needs.h"
#include "sim/need/press_needs.h"
#include "sim/plan/change_units.h"
#include "sim/press/gel_setup.h"
#include "sim/scene/light_limits.h"

namespace touchstone::sim {
namespace {

using nlohmann::json;

/// Raised with each change of how needs are measured, or of their file.
constexpr int kNeedFormat = 6;

std::string text_of(const SceneNeeds& needs) {
  json all = json::array();
  for (const EffectNeed& need : needs) {
    json one = {{"effect", need.effect}, {"note", need.note}};
    if (need.change) {
      json change = json::object();
      for (const ChangeUnit& unit : kChangeUnits) {
        if ((*need.change).*unit.changed) change[unit.key] = *((*need.change).*unit.changed);
      }
      one["change"] = change;
    }
    all.push_back(one);
  }
  return all.dump(2) + "\n";
}

/// Nothing if the file isn't there or isn't what text_of() writes: it is then made anew.
std::optional<SceneNeeds> read_needs(const std::filesystem::path& file) {
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) return std::nullopt;
  try {
    SceneNeeds needs;
    const json all = json::parse(read_whole_file(file));
    if (!all.is_array()) return std::nullopt;
    for (const json& one : all) {
      EffectNeed need{one.at("effect").get<std::string>(), {}, one.at("note").get<std::string>()};
      if (one.contains("change")) {
        need.change.emplace();
        for (const ChangeUnit& unit : kChangeUnits) {
          if (!one["change"].contains(unit.key)) continue;
          const double amount = one["change"][unit.key].get<double>();
          if (!(amount >= 0.0)) return std::nullopt;
          (*need.change).*unit.changed = amount;
        }
      }
      needs.push_back(std::move(need));
    }
    return needs;
  } catch (const std::exception&) {
    return std::nullopt;
  }
}

/// As it would be without a wish for accuracy.
SceneSpec without_accuracy(SceneSpec scene) {
  scene.accuracy.reset();
  scene.device.accuracy.reset();
  return scene;
}

/// What an endlessly fine mesh would change in these states: the error bar of the force.
EffectNeed mesh_need(std::span<const Truth> truths, std::span<const int> frames) {
  double most = 0.0;
  for (const int k : frames) {
    const Truth& truth = truths[static_cast<std::size_t>(k)];
    const double force = truth.press.wrench.head<3>().norm();
    if (force > 0.0) most = std::max(most, truth.error.force.norm() / force);
  }
  EffectNeed need{kFinerMesh, {}, {}};
  need.change.emplace().force_percent = 100.0 * most;
  return need;
}

}  // namespace

SceneNeeds measure_needs(const SceneSpec& wanted, const fem::Compliance& gel, const NeedSettings& settings,
                         const std::filesystem::path& cache, const Progress& progress) {
  const SceneSpec scene = without_accuracy(wanted);
  const Plan plan = make_plan(scene);
  constexpr int kStages = 4;
  const auto stage = [&](int done) {
    if (progress) progress("what effects change", done, kStages);
  };
  SceneNeeds needs;
  stage(0);
  const std::vector<Truth> truths = play_for_need(scene, plan, gel, cache);
  const std::vector<int> frames = hard_frames(truths);
  if (frames.empty()) return needs;
  needs.push_back(mesh_need(truths, frames));
  stage(1);
  add_played_needs(scene, plan, gel, truths, frames, cache, needs);
  stage(2);
  if (!plan.finite_strain && settings.finite_edges > 0.0) {
    const auto weaker = [&](int a, int b) {
      return strongest_force(truths[static_cast<std::size_t>(a)].press) <
             strongest_force(truths[static_cast<std::size_t>(b)].press);
    };
    const int strongest = *std::max_element(frames.begin(), frames.end(), weaker);
    add_finite_strain_need(scene, plan, truths[static_cast<std::size_t>(strongest)], settings.finite_edges, cache,
                           needs);
  }
  stage(3);
  if (plan.camera) add_picture_needs(scene, plan, gel, truths, frames, settings, light_limits(wanted), needs);
  stage(kStages);
  return needs;
}

Plan plan_by_need(const SceneSpec& scene, const std::string& key, const std::filesystem::path& cache,
                  const Progress& progress) {
  if (!scene.accuracy && !scene.device.accuracy) return make_plan(scene);
  make_plan(scene);  // what can't be had is said before anything is measured
  const std::filesystem::path file =
      cache.empty() || key.empty()
          ? std::filesystem::path()
          : cache / fmt::format("need-{}.json", sha256_of(fmt::format("needs, format {}\n{}", kNeedFormat, key)));
  if (!file.empty()) {
    if (const std::optional<SceneNeeds> kept = read_needs(file)) return make_plan(scene, *kept);
  }
  const SceneNeeds needs = measure_needs(scene, *set_up_gel(scene.device, cache, progress), {}, cache, progress);
  if (!file.empty()) write_whole_file(file, text_of(needs));
  return make_plan(scene, needs);
}

}  // namespace touchstone::sim
