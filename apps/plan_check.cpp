#include "apps/plan_check.h"

#include <algorithm>

#include "apps/progress_bar.h"
#include "core/seconds_since.h"
#include "sim/need/scene_needs.h"
#include "sim/plan/change_units.h"
#include "sim/press/gel_setup.h"

namespace touchstone::apps {
namespace {

struct Look {
  sim::SceneNeeds needs;
  double seconds = 0.0;
};

std::string in_words(std::optional<double> amount) {
  return amount ? fmt::format("{:.2g}", *amount) : "-";
}

bool is_on(const sim::Plan& plan, const std::string& effect) {
  return std::any_of(plan.effects.begin(), plan.effects.end(),
                     [&](const sim::Effect& one) { return one.name == effect && one.on; });
}

}  // namespace

void print_plan_check(const sim::SceneSpec& scene, const sim::Plan& plan, const GlobalOptions& global) {
  const sim::Accuracy allowed = sim::accuracy_of(scene.accuracy, scene.device.accuracy).value_or(sim::Accuracy{});
  Look first, close;
  {
    ProgressBar bar(global.quiet);
    const auto gel = sim::set_up_gel(scene.device, global.cache, bar.listener());
    const auto look = [&](const sim::NeedSettings& settings) {
      const auto begun = std::chrono::steady_clock::now();
      Look result{sim::measure_needs(scene, *gel, settings, global.cache, bar.listener()), 0.0};
      result.seconds = seconds_since(begun);
      return result;
    };
    first = look({});
    close = look(sim::kCloseLook);
  }
  if (first.needs.empty()) {
    fmt::print("\nnothing touches: there are no hard states to look at\n");
    return;
  }
  fmt::print("\nwhat effects change in the hardest states, as the plan measures it ({:.1f} s) and closely ({:.1f} s)\n",
             first.seconds, close.seconds);
  fmt::print("{:<16}  {:<3}  {:<14}  {:>8}  {:>8}  {:>8}  {}\n", "effect", "on", "unit", "plan", "closely", "allowed",
             "verdict");
  for (const sim::EffectNeed& need : first.needs) {
    const bool on = is_on(plan, need.effect);
    const sim::Change* found = sim::change_of(close.needs, need.effect);
    if (!need.change || found == nullptr) {
      const auto same = [&](const sim::EffectNeed& one) { return one.effect == need.effect; };
      const auto other = std::find_if(close.needs.begin(), close.needs.end(), same);
      fmt::print("{:<16}  {:<3}  not measured: {}\n", need.effect, on ? "yes" : "no",
                 need.change && other != close.needs.end() ? other->note : need.note);
      continue;
    }
    const bool called_for = sim::exceeds(*found, allowed);
    const char* verdict = on == called_for ? "right" : on ? "could be left out" : "LEFT OUT";
    for (const sim::ChangeUnit& unit : sim::kChangeUnits) {
      const std::optional<double>& planned = (*need.change).*unit.changed;
      const std::optional<double>& closely = (*found).*unit.changed;
      if (!planned && !closely) continue;
      fmt::print("{:<16}  {:<3}  {:<14}  {:>8}  {:>8}  {:>8}  {}\n", need.effect, on ? "yes" : "no", unit.name,
                 in_words(planned), in_words(closely), fmt::format("{:.3g}", allowed.*unit.allowed), verdict);
    }
  }
}

}  // namespace touchstone::apps
