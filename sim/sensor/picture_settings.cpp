#include "sim/sensor/picture_settings.h"

#include <cmath>

#include "sim/scene/light_limits.h"

namespace touchstone::sim {
namespace {

constexpr double kKeyFrameFraction = 0.5;
constexpr int kFirstFrameSamples = 4;

}  // namespace

render::NoiseTarget noise_target(const render::ImagerResponse& response, double fraction) {
  const render::QuantumEfficiency& channels = response.electrons_per_irradiance;
  render::NoiseTarget target;
  target.electrons_per_irradiance = channels.colwise().sum().transpose().array();
  const double all = target.electrons_per_irradiance.sum();
  if (all > 0.0) target.electrons_per_irradiance *= channels.rowwise().sum().maxCoeff() / all;
  target.read_noise_e = response.read_noise_e;
  target.quantisation_e = response.quantisation_e / std::sqrt(12.0);
  target.fraction = fraction;
  return target;
}

render::RenderSettings picture_settings(const SceneSpec& scene, const render::ImagerResponse& response) {
  render::RenderSettings settings;
  settings.seed = scene.seed;
  const LightLimits limits = light_limits(scene);
  settings.min_samples = limits.min_samples;
  settings.max_samples = limits.max_samples;
  settings.noise = noise_target(response, limits.noise_fraction);
  return settings;
}

render::RenderSettings key_frame_settings(const SceneSpec& scene, const render::ImagerResponse& response, bool first) {
  render::RenderSettings well = picture_settings(scene, response);
  well.noise = noise_target(response, kKeyFrameFraction * light_limits(scene).noise_fraction);
  if (first) well.max_samples *= kFirstFrameSamples;
  return well;
}

}  // namespace touchstone::sim
