#pragma once
// What bench_light measures of the direct renderer on a gelsight-like device and through a hole.

#include "bench/light_sections.h"

namespace touchstone::bench {

/// Pictures a second and error on a membrane that a ball and a coin press, with what the rest state's bounced light
/// gains against full path tracing.
ResultTable gelsight_frames_table(const LightOptions& options);
/// Error against time for the number of rays cast across the hole's blur.
ResultTable hole_blur_table(const LightOptions& options);

}  // namespace touchstone::bench
