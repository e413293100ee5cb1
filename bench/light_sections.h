#pragma once
// What bench_light measures, a table each.

#include <filesystem>

#include "bench/result_table.h"

namespace touchstone::bench {

struct LightOptions {
  bool quick = false;           ///< all tables in under half a minute
  std::filesystem::path cache;  ///< of gels
};

/// The path tracer's seconds against Embree's alone on the very same rays.
ResultTable bare_rays_table(const LightOptions& options);
/// Error against seconds of both renderers.
ResultTable light_error_table(const LightOptions& options);
/// Pictures a second of the direct renderer, the membrane moving, and their error.
ResultTable direct_frames_table(const LightOptions& options);
/// Growth with triangles, pixels and bands.
ResultTable light_growth_table(const LightOptions& options);
/// What each effect costs when it's on: rays and seconds against a plain scene.
ResultTable light_effects_table(const LightOptions& options);
/// The vhs device at its default accuracy.
ResultTable device_frames_table(const LightOptions& options);

}  // namespace touchstone::bench
