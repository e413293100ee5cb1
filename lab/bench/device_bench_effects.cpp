// What each effect buys: switched over one by one.

#include <cmath>

#include "core/error.h"
#include "lab/bench/device_bench_parts.h"
#include "sim/plan/plan.h"
#include "sim/scene/device_imager.h"
#include "sim/view/visible_scene.h"

namespace touchstone::lab {
namespace {

constexpr sim::SwitchedEffect kSwitches[] = {
    {"friction", &sim::EffectSwitches::friction, &sim::Plan::friction},
    {"fine relief", &sim::EffectSwitches::fine_relief, &sim::Plan::fine_relief},
    {"stress relaxation", &sim::EffectSwitches::relaxation, &sim::Plan::relaxation},
    {"interreflection", &sim::EffectSwitches::interreflection, &sim::Plan::interreflection},
    {"diffraction", &sim::EffectSwitches::diffraction, &sim::Plan::diffraction},
    {"direct light", &sim::EffectSwitches::direct_light, &sim::Plan::direct_light},
    {"shared paths", &sim::EffectSwitches::shared_paths, &sim::Plan::shared_paths},
    {"motion blur", &sim::EffectSwitches::motion_blur, &sim::Plan::motion_blur},
    {"rolling shutter", &sim::EffectSwitches::rolling_shutter, &sim::Plan::rolling_shutter},
    {"sensor noise", &sim::EffectSwitches::sensor_noise, &sim::Plan::sensor_noise},
};

double frame_seconds(const TwoRuns& runs) {
  double sum = 0.0;
  for (const SceneRun& run : runs) sum += run.mechanics_seconds + run.picture_seconds;
  return 0.5 * sum;
}

double once_seconds(const TwoRuns& runs) {
  return 0.5 * (runs[0].camera_seconds + runs[1].camera_seconds);
}

}  // namespace

std::span<const sim::SwitchedEffect> switched_effects() {
  return kSwitches;
}

std::vector<EffectShare> effect_shares(const BenchParts& parts, const Progress& progress) {
  std::vector<EffectShare> shares;
  sim::SceneSpec scene =
      bench_scene(parts.device, parts.presses, parts.presses.specs.front(), parts.settings.seed + 70);
  if (!parts.truth) scene.outputs = {.frames = false};
  const sim::Plan plan = sim::make_plan(scene);
  const TwoRuns with = run_twice(scene, parts.own_gel);
  const render::Imager imager = parts.truth ? sim::imager(parts.device, plan.bands, true) : render::Imager{};

  const auto add = [&](const std::string& name, bool planned, const sim::SceneSpec& switched) {
    if (progress) progress("effects", static_cast<std::int64_t>(shares.size()), std::size(kSwitches) + 4);
    EffectShare share;
    share.name = name;
    share.planned = planned;
    try {
      const TwoRuns without = run_twice(switched, parts.own_gel);
      share.force_change = force_difference(without[0].force_N, with[0].force_N);
      if (parts.truth) {
        share.pixel_change = pixel_error(without, with, imager);
        share.number_change = number_difference(without[0].numbers, with[0].numbers);
      }
      share.seconds =
          planned ? frame_seconds(with) - frame_seconds(without) : frame_seconds(without) - frame_seconds(with);
      share.once_s = planned ? once_seconds(with) - once_seconds(without) : once_seconds(without) - once_seconds(with);
    } catch (const Error& error) {
      share.note = error.what();
    }
    shares.push_back(share);
  };

  EffectShare all;
  all.name = "all as planned";
  all.planned = true;
  all.seconds = frame_seconds(with);
  all.once_s = once_seconds(with);
  shares.push_back(all);
  for (const sim::SwitchedEffect& one : kSwitches) {
    const bool planned = plan.*one.planned;
    const bool of_pictures = one.of != &sim::EffectSwitches::friction && one.of != &sim::EffectSwitches::relaxation;
    if (of_pictures && !parts.truth) continue;
    sim::SceneSpec switched = scene;
    switched.effects.*one.of = planned ? sim::Switch::off : sim::Switch::on;
    if (!planned) {
      try {
        if (!(sim::make_plan(switched).*one.planned)) continue;
      } catch (const Error&) {
        continue;  // this device can't have it
      }
      if (one.of == &sim::EffectSwitches::relaxation) continue;  // without a series it's the same gel
    }
    add(one.name, planned, switched);
  }
  if (parts.truth && plan.refraction) {
    sim::SceneSpec switched = scene;
    switched.device.gel.refractive_index = switched.device.plate.refractive_index = 1.0;
    add("refraction", true, switched);
  }
  if (parts.truth && plan.scattering) {
    sim::SceneSpec switched = scene;
    switched.device.gel.scattering_per_mm = 0.0;
    add("scattering", true, switched);
  }
  if (parts.truth && plan.bands.ranges && plan.bands.count() > 3) {
    sim::SceneSpec switched = scene;
    switched.device.bands->count = 3;
    add(fmt::format("{} bands in place of 3", plan.bands.count()), true, switched);
  }
  if (parts.settings.finite_strain) {
    sim::SceneSpec switched = scene;
    switched.effects.elasticity = sim::Elasticity::neo_hookean;
    switched.outputs = {.frames = false};
    if (progress) progress("effects: finite strain", 0, 1);
    EffectShare share;
    share.name = "finite strain (neo-Hookean)";
    try {
      const SceneRun run = run_scene(switched, parts.own_gel);
      share.force_change = force_difference(run.force_N, with[0].force_N);
      share.seconds = run.mechanics_seconds - with[0].mechanics_seconds;
      share.once_s = 0.0;
      share.note = fmt::format("largest strain {:.2g}; pictures weren't made", with[0].largest_strain);
    } catch (const Error& error) {
      share.note = error.what();
    }
    shares.push_back(share);
  }
  return shares;
}

}  // namespace touchstone::lab
