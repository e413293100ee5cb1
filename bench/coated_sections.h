#pragma once
// What bench_light measures of the coated devices' own pictures.

#include "bench/light_sections.h"

namespace touchstone::bench {

/// How far the pictures of the devices' virtual sensors are off path tracing, under a ball, a coin, a fingerprint and a
/// plug.
ResultTable coated_error_table(const LightOptions& options);
/// What a labelled picture of them takes, in parts: processor time of one thread, and the clock on all.
ResultTable coated_time_table(const LightOptions& options);

}  // namespace touchstone::bench
