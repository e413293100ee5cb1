#include "sim/plan_direct.h"

namespace touchstone::sim {

std::string unfit_for_direct_light(const SceneSpec& scene, const Plan& plan) {
  const DeviceSpec& device = scene.device;
  if (!device.coating) return "the gel has no coating: its outer face refracts";
  if (plan.scattering) return "the gel scatters light";
  if (device.lamps.empty()) return "the device has no lamps";
  for (const LampSpec& lamp : device.lamps) {
    if (lamp.visible) return "a lamp has a body that is seen";
  }
  if (plan.events) return "event pixels' light is path-traced, and frames beside them are to match it";
  if (scene.outputs.error) return "the standard error of path tracing is asked for";
  return {};
}

void plan_direct_light(const SceneSpec& scene, Plan& plan, PlanTable& table) {
  const std::string name = "direct light";
  const Switch forced = scene.effects.direct_light;
  if (!scene.outputs.light()) {
    table.add(name, false, "no picture is asked for", "");
    return;
  }
  const std::string unfit = unfit_for_direct_light(scene, plan);
  if (forced == Switch::on && !unfit.empty()) fail_at(scene.where, "effects.direct_light: on, but {}", unfit);
  const std::string why =
      !unfit.empty()
          ? unfit
          : fmt::format(
                "an opaque coating, {}; {:.3g} % off path tracing is allowed, which is measured on "
                "the deepest press before the first picture",
                plan.interreflection ? "with the bounced light of the gel at rest" : "without interreflection",
                100 * scene.light.direct_tolerance);
  plan.direct_light = table.add(name, forced, unfit.empty(), why,
                                "in place of path tracing: some milliseconds a frame; once a scene a light field, its "
                                "bounced light and the measurement");
}

}  // namespace touchstone::sim
