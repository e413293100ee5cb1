#include "datasets/sets/drawn_needs.h"

#include <algorithm>

#include "sim/need/scene_needs.h"
#include "sim/need/switched_effect.h"

namespace touchstone::datasets {
namespace {

/// What a plan may switch for a sensor: what it measures. Friction is always simulated, or touches without a drag would
/// be of another kind.
constexpr sim::SwitchedEffect kSwitched[] = {
    {"fine relief", &sim::EffectSwitches::fine_relief, &sim::Plan::fine_relief},
    {"interreflection", &sim::EffectSwitches::interreflection, &sim::Plan::interreflection},
    {"diffraction", &sim::EffectSwitches::diffraction, &sim::Plan::diffraction}};

std::string key_of(const PreparedDraw& prepared, const PlannedDraw& one) {
  std::string key = fmt::format("draw, sample {}\n{}\n", one.sample, prepared.text);
  for (const InputFile& file : prepared.inputs) key += fmt::format("{}  {}\n", file.sha256, file.name);
  return key;
}

/// On if any of them is, off if none is.
template <typename Wanted>
sim::Switch any_of(const std::vector<NeededDraw>& needed, const Wanted& wanted) {
  return std::any_of(needed.begin(), needed.end(), [&](const NeededDraw& one) { return wanted(one.plan); })
             ? sim::Switch::on
             : sim::Switch::off;
}

}  // namespace

std::vector<NeededDraw> plan_by_need(PreparedDraw& prepared, const std::filesystem::path& cache,
                                     const Progress& progress) {
  std::vector<NeededDraw> needed;
  if (!drawn_unit(prepared, 0).device.accuracy) return needed;
  bool seen = false;
  for (PlannedDraw& one : planned_draws(prepared, StandsFor::hardest)) {
    // What the sensor switches by itself is to be decided here.
    if (!one.scene.object.elastic) one.scene.effects.fine_relief = prepared.job.effects.fine_relief;
    seen = seen || one.scene.outputs.camera();
    sim::Plan plan = sim::plan_by_need(one.scene, key_of(prepared, one), cache, progress);
    needed.push_back({std::move(one), std::move(plan)});
  }
  const auto finite = any_of(needed, [](const sim::Plan& plan) { return plan.finite_strain; });
  prepared.effects.elasticity = finite == sim::Switch::on ? sim::Elasticity::neo_hookean : sim::Elasticity::linear;
  for (const sim::SwitchedEffect& one : kSwitched) {
    if (!seen || prepared.effects.*one.of != sim::Switch::automatic) continue;
    prepared.effects.*one.of = any_of(needed, [&](const sim::Plan& plan) { return plan.*one.planned; });
  }
  return needed;
}

std::string in_words(const sim::EffectSwitches& effects) {
  const bool finite = effects.elasticity == sim::Elasticity::neo_hookean;
  std::string words = finite ? "finite strain on" : "finite strain off";
  for (const sim::SwitchedEffect& one : kSwitched) {
    const sim::Switch is = effects.*one.of;
    if (is != sim::Switch::automatic) words += fmt::format(", {} {}", one.name, is == sim::Switch::on ? "on" : "off");
  }
  return words;
}

}  // namespace touchstone::datasets
