#include "sim/scene/event_camera_spec.h"

#include <algorithm>

namespace touchstone::sim {
namespace {

/// The only imager of render/imager/imager_presets.h that has event pixels.
constexpr const char* kDavis240c = "davis240c";

bool read_preset(YamlReader& in, render::EventPixelSettings& pixels) {
  if (!in.has("preset")) return false;
  in.required_name("preset", {kDavis240c});
  double white = 0.0;
  in.required("white_1klux_e_per_s", white, Allowed::within(1e-6, 1e18));
  pixels = render::davis240c(white);
  return true;
}

}  // namespace

void fields(YamlReader& in, EventCameraSpec& events) {
  render::EventPixelSettings& pixels = events.pixels;
  const bool preset = read_preset(in, pixels);
  const auto needed = [&in](bool there_already, const char* key, double& value, Allowed allowed) {
    there_already ? in.optional(key, value, allowed) : in.required(key, value, allowed);
  };
  // The ranges are those of render::check, so that the line in the file is named.
  const Allowed threshold = Allowed::within(render::kLeastEventThreshold, render::kLargestEventThreshold);
  const Allowed rate = Allowed::within(0.0, render::kFastestEventRate_hz);
  const Allowed light = Allowed::within(1e-30, 1e18);
  in.optional("on_threshold", pixels.on_threshold, threshold);
  in.optional("off_threshold", pixels.off_threshold, threshold);
  in.optional("threshold_spread", pixels.threshold_spread,
              Allowed::within(0.0, std::min(pixels.on_threshold, pixels.off_threshold)));
  needed(preset, "dark_e_per_s", pixels.dark_intensity, light);
  in.optional("bandwidth_Hz", pixels.bandwidth_hz, Allowed::within(0.0, 1e12));
  needed(preset || pixels.bandwidth_hz == 0.0, "reference_e_per_s", pixels.reference_intensity, light);
  in.optional("refractory_us", pixels.refractory_us, Allowed::within(0.0, render::kLongestRefractory_us));
  in.optional("leak_rate_Hz", pixels.leak_rate_hz, rate);
  in.optional("shot_rate_Hz", pixels.shot_rate_hz, rate);
  needed(preset || pixels.shot_rate_hz == 0.0, "shot_half_e_per_s", pixels.shot_half_intensity, light);
  render::check(pixels);
}

}  // namespace touchstone::sim
