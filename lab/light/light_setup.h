#pragma once
// What the closed forms of light are rendered with: one band, an empty scene, a fixed number of samples.

#include <cstdint>

#include "render/paths/path_tracer.h"

namespace touchstone::lab {

/// A spectrum of the one band.
inline render::Spectrum grey(double value) {
  return render::Spectrum::Constant(1, value);
}

/// Nothing but surroundings of this radiance.
inline render::Scene empty_scene(double radiance) {
  render::Scene scene;
  scene.environment = grey(radiance);
  return scene;
}

/// As many samples for each pixel or direction, and no end to bounces.
inline render::RenderSettings samples(int count, std::uint64_t seed) {
  render::RenderSettings settings;
  settings.seed = seed;
  settings.min_samples = settings.max_samples = count;
  settings.max_depth = 10000;
  return settings;
}

}  // namespace touchstone::lab
