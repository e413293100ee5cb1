#include "sim/plan/plan_direct.h"

#include "sim/scene/device_camera.h"
#include "sim/scene/light_limits.h"

namespace touchstone::sim {
namespace {

// Behind a narrower hole a pixel's mean would have less than some thirty paths.
constexpr double kWidePoint_px = 6.0;

}  // namespace

std::string unfit_for_direct_light(const SceneSpec& scene, const Plan& plan) {
  const DeviceSpec& device = scene.device;
  if (!device.coating) return "the gel has no coating: its outer face refracts";
  if (plan.scattering) return "the gel scatters light";
  if (device.lamps.empty()) return "the device has no lamps";
  for (const LampSpec& lamp : device.lamps) {
    if (lamp.visible) return "a lamp has a body that is seen";
  }
  if (scene.outputs.error) return "the standard error of path tracing is asked for";
  return {};
}

void plan_diffraction(const SceneSpec& scene, Plan& plan, PlanTable& table) {
  const std::string name = "diffraction";
  const Switch forced = scene.effects.diffraction;
  if (!scene.outputs.light()) {
    table.add(name, false, "no picture is asked for", "");
    return;
  }
  std::string unfit;
  std::string why;
  const render::DiffractingAperture aperture = aperture_of(scene.device, plan.bands.centres_nm);
  const double shortest = plan.bands.centres_nm.minCoeff();
  if (aperture.in_focus) {
    constexpr double kAirysDisc = 2.44;  // its diameter, of wavelength times f-number
    const double disc_um =
        kAirysDisc * 1e-3 * plan.bands.centres_nm.mean() * aperture.to_sensor_mm / aperture.diameter_mm;
    why = fmt::format("the stop makes Airy's disc of points, {:.2g} um wide; pixels are {:.3g} um wide", disc_um,
                      scene.device.camera->pixel_pitch_um);
  } else {
    const double most = fresnel_number(aperture, shortest);
    why = fmt::format(
        "Fresnel's number of the hole is {:.2g}: at 1 its picture is sharpest, far above 1 it is the "
        "hole's disc",
        most);
    if (most > render::DiffractionSpread::kMostFresnel) {
      unfit = fmt::format(
          "Fresnel's number of the hole is {:.3g}; up to {} diffraction is simulated, beyond it light goes "
          "straight",
          most, render::DiffractionSpread::kMostFresnel);
    }
  }
  if (plan.scattering) unfit = "the gel scatters light, which blurs more";
  if (scene.outputs.events) unfit = "event pixels' pictures are drawn without it";
  if (forced == Switch::on && !unfit.empty()) fail_at(scene.where, "effects.diffraction: on, but {}", unfit);
  if (!unfit.empty()) {
    table.add(name, false, unfit, "");
    return;
  }
  plan.diffraction =
      table.add_by_need(name, forced, false, why, "tables once, some tenths of a second; a wider blur of each picture");
}

void plan_direct_light(const SceneSpec& scene, Plan& plan, PlanTable& table) {
  const std::string name = "direct light";
  const Switch forced = scene.effects.direct_light;
  if (!scene.outputs.light() && !scene.outputs.events) {
    table.add(name, false, "no picture is asked for", "");
    return;
  }
  const std::string unfit = unfit_for_direct_light(scene, plan);
  if (forced == Switch::on && !unfit.empty()) fail_at(scene.where, "effects.direct_light: on, but {}", unfit);
  const std::string why =
      !unfit.empty()
          ? unfit
          : fmt::format(
                "an opaque coating, {}; {} off path tracing is allowed, which is measured on "
                "the deepest press before the first picture",
                plan.interreflection ? "with the bounced light of the gel at rest" : "without interreflection",
                direct_limit_in_words(light_limits(scene)));
  plan.direct_light = table.add(name, forced, unfit.empty(), why,
                                "in place of path tracing: some milliseconds a frame; once a scene a light field, its "
                                "bounced light and the measurement");
}

void plan_paths(const SceneSpec& scene, const Plan& plan, PlanTable& table) {
  const std::string name = "noise of paths";
  if (!scene.outputs.light()) {
    table.add(name, false, "no picture is asked for", "");
    return;
  }
  const LightLimits limits = light_limits(scene);
  const bool by_accuracy = table.accuracy() && !scene.light.noise_fraction;
  table.add(name, true,
            fmt::format("each pixel gets {} to {} paths, until it is uncertain by {:.2g} of the imager's noise{}{}",
                        limits.min_samples, limits.max_samples, limits.noise_fraction,
                        by_accuracy ? fmt::format(": half of the variance that {:.2g} of the noise allows",
                                                  table.accuracy()->pixel_noise)
                                    : "",
                        plan.direct_light ? "; direct light has none" : ""),
            "most of a traced picture's time");
}

void plan_shared_paths(const SceneSpec& scene, Plan& plan, PlanTable& table) {
  const std::string name = "shared paths";
  const Switch forced = scene.effects.shared_paths;
  if (!scene.outputs.light()) {
    table.add(name, false, "no picture is asked for", "");
    return;
  }
  const double width_px = 2.0 * least_blur_radius_px(camera_of(*scene.device.camera));
  const bool wide = width_px >= kWidePoint_px;
  std::string unfit;
  if (plan.scattering) unfit = "the gel scatters light, which has no one depth";
  if (!wide) {
    unfit =
        fmt::format("the camera's hole makes points {:.2g} pixels wide; below {:.2g} each pixel needs its own paths",
                    width_px, kWidePoint_px);
  }
  if (std::holds_alternative<LensSpec>(scene.device.camera->optics)) {
    unfit = "through a lens the blur depends on the depth";
  }
  if (forced == Switch::on && !unfit.empty()) fail_at(scene.where, "effects.shared_paths: on, but {}", unfit);
  plan.shared_paths = table.add(
      name, forced, unfit.empty() && !plan.direct_light,
      plan.direct_light ? "direct light has no paths"
      : !unfit.empty()
          ? unfit
          : fmt::format("the hole makes points at least {:.2g} pixels wide: neighbours see the same places", width_px),
      "one path a pixel or fewer, in place of some for each pixel that changes");
}

}  // namespace touchstone::sim
