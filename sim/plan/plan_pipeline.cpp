#include "sim/plan/plan_pipeline.h"

#include "core/overloaded.h"
#include "core/units.h"

namespace touchstone::sim {
namespace {

std::string tone_in_words(const render::ToneCurve& curve) {
  return std::visit(Overloaded{[](const render::LinearTone&) -> std::string { return "in proportion to the light"; },
                               [](const render::SrgbTone&) -> std::string { return "along sRGB's curve"; },
                               [](const render::GammaTone& power) {
                                 return fmt::format("as the light to the power of 1/{:.4g}", power.gamma);
                               },
                               [](const MonotoneCurve& curve_of) {
                                 return fmt::format("along a curve of {} measured points", curve_of.points().size());
                               }},
                    curve);
}

/// The reason of a block of `camera` that the device has or hasn't.
template <typename Spec, typename Words>
std::string stated(const std::optional<Spec>& spec, const char* key, const Words& words) {
  return spec ? words(*spec) : fmt::format("the device has no camera.{}", key);
}

void refuse_long_exposures(const SceneSpec& scene) {
  const CameraSpec& camera = *scene.device.camera;
  const double longest_us = camera.auto_exposure->highest * camera.exposure_us;
  const double frame_us = kMicrosecondsPerSecond / scene.motion.frame_rate_Hz;
  if (longest_us <= frame_us) return;
  fail_at(scene.where,
          "the camera of the device '{}' exposes for up to {} us (auto_exposure), which is longer than a frame of the "
          "motion, {} us at {} Hz",
          scene.device.name, longest_us, frame_us, scene.motion.frame_rate_Hz);
}

}  // namespace

void plan_pipeline(const SceneSpec& scene, Plan& plan, PlanTable& table) {
  const CameraSpec& camera = *scene.device.camera;
  const bool shown = scene.outputs.frames || scene.outputs.ideal;
  const char* none = "no picture is asked for";
  const auto* lens = std::get_if<LensSpec>(&camera.optics);
  const bool vignetted = lens != nullptr && lens->vignetting;
  plan.vignetting = table.add("vignetting", vignetted,
                              vignetted         ? "the device's lens has it, beside cos^4"
                              : lens != nullptr ? "the device has no camera.vignetting: cos^4 alone"
                                                : "the camera has no lens",
                              "some 20 nanoseconds a ray");
  const bool hot = camera.hot_pixels.share > 0.0;
  plan.hot_pixels = table.add("hot pixels", hot && plan.sensor_noise,
                              !hot ? "the device has no camera.hot_pixels"
                              : plan.sensor_noise
                                  ? fmt::format("{:.3g} % of the pixels have some {:.3g} e-/s",
                                                100.0 * camera.hot_pixels.share, camera.hot_pixels.dark_current_e_per_s)
                                  : "there is no sensor noise",
                              "under a millisecond a frame");
  const char* metering = "a preview a frame, and 2 milliseconds for the meter that reads it";
  plan.auto_exposure = table.add(
      "auto exposure", camera.auto_exposure && shown,
      !shown ? none
             : stated(camera.auto_exposure, "auto_exposure",
                      [](const render::AutoExposure& automatic) {
                        return fmt::format(
                            "the camera keeps its pictures' mean at {:.3g} of full scale, within some {:.3g} s",
                            automatic.mean_level, automatic.time_constant_s);
                      }),
      metering);
  if (plan.auto_exposure) refuse_long_exposures(scene);
  plan.auto_white_balance =
      table.add("auto white balance", camera.auto_white_balance && shown,
                !shown ? none
                       : stated(camera.auto_white_balance, "auto_white_balance",
                                [](const render::AutoWhiteBalance& automatic) {
                                  return fmt::format("the camera makes its pictures' mean grey, within some {:.3g} s",
                                                     automatic.time_constant_s);
                                }),
                plan.auto_exposure ? "what auto exposure has read" : metering);
  const bool linear = std::holds_alternative<render::LinearTone>(camera.tone_curve);
  plan.tone_curve =
      table.add("tone curve", !linear && shown,
                shown ? fmt::format("the camera delivers its numbers {}", tone_in_words(camera.tone_curve)) : none,
                "under a millisecond a frame");
  plan.jpeg = table.add("JPEG", camera.jpeg && plan.sensor_noise,
                        camera.jpeg && !plan.sensor_noise
                            ? "there is no sensor noise: ideal pictures have no losses"
                            : stated(camera.jpeg, "jpeg",
                                     [](const render::JpegSettings& jpeg) {
                                       return fmt::format("the camera delivers JPEGs of quality {}", jpeg.quality);
                                     }),
                        "1 to 2 milliseconds a frame");
}

}  // namespace touchstone::sim
