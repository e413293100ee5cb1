#include "sim/scene/light_limits.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "sim/scene/device_imager.h"
#include "sim/scene/scene.h"

namespace touchstone::sim {
namespace {

constexpr double kVarianceOfLight = 0.5;

}  // namespace

LightLimits light_limits(const SceneSpec& scene) {
  LightLimits limits;
  if (const auto accuracy = accuracy_of(scene.accuracy, scene.device.accuracy)) {
    limits.noise_fraction = std::sqrt(kVarianceOfLight) * accuracy->pixel_noise;
    limits.max_samples = kMostPathsByNeed;
    limits.direct_noise = limits.noise_fraction;
    if (scene.device.camera)  // for a light field's own
      limits.direct_tolerance = std::min(1.0, limits.noise_fraction * least_noise_share(*scene.device.camera));
  }
  const LightSpec& stated = scene.light;
  limits.noise_fraction = stated.noise_fraction.value_or(limits.noise_fraction);
  limits.max_samples = stated.max_samples.value_or(std::max(limits.max_samples, stated.min_samples.value_or(1)));
  limits.min_samples = std::min(stated.min_samples.value_or(limits.min_samples), limits.max_samples);
  if (stated.direct_tolerance) {
    limits.direct_tolerance = *stated.direct_tolerance;
    limits.direct_noise.reset();
  }
  return limits;
}

std::string direct_limit_in_words(const LightLimits& limits) {
  return limits.direct_noise ? fmt::format("{:.2g} of the imager's noise", *limits.direct_noise)
                             : fmt::format("{:.3g} %", 100.0 * limits.direct_tolerance);
}

}  // namespace touchstone::sim
