// The device's pictures as plans have them, by fixed shares and by need, on presses that nothing was chosen by.

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "core/error.h"
#include "lab/bench/device_bench_parts.h"
#include "sim/need/scene_needs.h"
#include "sim/plan/plan.h"

namespace touchstone::lab {
namespace {

/// What a plan by need switches in pictures. Finite strain isn't among them: references are linear.
constexpr std::array kOfPictures = {
    sim::SwitchedEffect{"friction", &sim::EffectSwitches::friction, &sim::Plan::friction},
    sim::SwitchedEffect{"fine relief", &sim::EffectSwitches::fine_relief, &sim::Plan::fine_relief},
    sim::SwitchedEffect{"interreflection", &sim::EffectSwitches::interreflection, &sim::Plan::interreflection},
    sim::SwitchedEffect{"diffraction", &sim::EffectSwitches::diffraction, &sim::Plan::diffraction},
    sim::SwitchedEffect{"motion blur", &sim::EffectSwitches::motion_blur, &sim::Plan::motion_blur},
    sim::SwitchedEffect{"rolling shutter", &sim::EffectSwitches::rolling_shutter, &sim::Plan::rolling_shutter}};

std::string effects_in_words(const sim::Plan& plan) {
  std::string words;
  for (const sim::SwitchedEffect& one : kOfPictures) {
    if (plan.*one.planned) words += fmt::format("{}{}", words.empty() ? "" : ", ", one.name);
  }
  return words.empty() ? "none" : words;
}

std::string needs_in_words(const sim::SceneNeeds& needs, const sim::Accuracy& allowed) {
  std::string words;
  for (const sim::EffectNeed& need : needs) {
    if (need.effect == sim::kFinerMesh) continue;  // a bench's gels have no error of their own; the reference says it
    if (!words.empty()) words += "; ";
    words += need.effect + " ";
    words += need.change ? sim::in_words(*need.change, allowed) : fmt::format("not measured ({})", need.note);
  }
  return words;
}

}  // namespace

PlannedBench planned_bench(const BenchParts& parts, const Progress& progress) {
  const auto tell = [&](int step) {
    if (progress) progress("as planned", step, 4);
  };
  tell(0);
  PlannedBench bench;
  const BenchParts other = with_other_presses(parts, parts.settings.seed + 2000);
  bench.force_error =
      force_difference(solve_presses(other.presses, parts.own_gel, parts.device, parts.device.mesh.fine_mm).force_N,
                       other.finest_forces.force_N);
  const sim::PressSpec& spec = other.presses.specs.front();
  sim::SceneSpec scene = bench_scene(parts.device, other.presses, spec, parts.settings.seed + 2001);
  if (!parts.truth) scene.outputs = {.frames = false};
  const sim::Plan by_shares = sim::make_plan(scene);
  tell(1);
  sim::SceneSpec stated = scene;
  stated.accuracy.emplace();
  const sim::SceneNeeds needs = sim::measure_needs(stated, parts.own_gel, {}, {});
  const sim::Plan by_need = sim::make_plan(stated, needs);
  bench.needs = needs_in_words(needs, *sim::accuracy_of(stated.accuracy, stated.device.accuracy));
  bench.finite_strain = by_need.finite_strain;
  tell(2);
  std::optional<TruePictures> truth;
  if (parts.truth)
    truth = true_pictures(other, parts.finest_device, parts.finest_gel, spec, parts.settings.seed + 2002);
  const auto add = [&](const char* name, const sim::Plan& plan, const std::optional<sim::AccuracySpec>& accuracy,
                       const sim::EffectSwitches& switches) {
    PlannedWay way;
    way.name = name;
    way.effects = effects_in_words(plan);
    LightSetting light;
    light.effects = switches;
    light.accuracy = accuracy;
    if (truth) {
      BenchPoint ignored;
      light = try_light(other, *truth, parts.device, parts.own_gel, light, parts.settings.seed + 2003, ignored);
      way.pixel_error = light.pixel_error;
      (std::isfinite(light.pixel_error) ? way.light : way.note) = ignored.note;
    }
    if (!truth || std::isfinite(light.pixel_error)) {
      const WholeSeconds seconds = whole_seconds(parts, 1.0, light);
      way.once_s = seconds.once;
      way.frame_s = seconds.frame;
      bench.by_middle = bench.by_middle || seconds.by_middle;
    }
    bench.ways.push_back(std::move(way));
  };
  sim::EffectSwitches shares;
  shares.elasticity = sim::Elasticity::linear;
  add("by fixed shares", by_shares, {}, shares);
  tell(3);
  for (const sim::SwitchedEffect& one : kOfPictures) {
    shares.*one.of = by_need.*one.planned ? sim::Switch::on : sim::Switch::off;
  }
  add("by need", by_need, stated.accuracy, shares);
  return bench;
}

std::string planned_page(const DeviceBench& all) {
  const PlannedBench& bench = all.planned;
  std::string text = fmt::format(
      "## As planned\n\nThe device as its file has it, its effects by fixed shares and by need (`accuracy: {{}}`), on "
      "presses that nothing was chosen by. References are linear, so finite strain is in none of these errors; by need "
      "it is {} here.\n\n| | wanted | {} | {} |\n|---|---|---|---|\n",
      bench.finite_strain ? "on" : "off", bench.ways[0].name, bench.ways[1].name);
  const auto row = [&](const std::string& head, const std::string& wanted, const auto& of) {
    text += fmt::format("| {} | {} | {} | {} |\n", head, wanted, of(bench.ways[0]), of(bench.ways[1]));
  };
  const auto number = [](double value) { return std::isfinite(value) ? fmt::format("{:.3g}", value) : std::string(); };
  row("force error, %", fmt::format("{:.3g}", 100.0 * all.settings.force_error),
      [&](const PlannedWay&) { return number(100.0 * bench.force_error); });
  row("pixel error, of the imager's noise", fmt::format("{:.3g}", all.settings.pixel_error),
      [&](const PlannedWay& way) {
        const bool too_small = way.pixel_error < all.least_pixel_error;
        return too_small ? fmt::format("< {:.2g}", all.least_pixel_error) : number(way.pixel_error) + way.note;
      });
  row("once, s", "", [&](const PlannedWay& way) { return number(way.once_s); });
  row(fmt::format("a frame, s{}", bench.by_middle ? " (from the middle, by the number of pixels)" : ""), "",
      [&](const PlannedWay& way) { return number(way.frame_s); });
  row("light", "", [&](const PlannedWay& way) { return way.light; });
  row("effects", "", [&](const PlannedWay& way) { return way.effects; });
  return text + fmt::format("\nLeaving out changes: {}.\n", bench.needs);
}

}  // namespace touchstone::lab
