#pragma once

#include "sim/files/colour.h"
#include "sim/scene/scene.h"

namespace touchstone::sim {

/// The bands that a scene's light is carried in. A device without `bands` has its band_wavelengths_nm; with them the
/// edges are put where the light's own curves are steep, and without a count the fewest of 1, 3, 8 and 16 are taken
/// that hold the tolerance on every path from a lamp over a coloured thing (twice through the film, if there is one)
/// into each of the camera's channels.
/// @throws Error if a lamp or the camera says nothing of the bands' range
/// @param tolerance in place of the device's `bands.tolerance`
SceneBands choose_bands(const SceneSpec& scene, std::optional<double> tolerance = {});

/// The largest relative error that the bands make of what a pixel reads; 0 where bands are just numbers.
double band_error(const SceneSpec& scene, const SceneBands& bands);

/// Every colour of the scene fits the bands, and every lamp can be made. @throws Error with file and line of the first
/// that doesn't
void check_light(const SceneSpec& scene, const SceneBands& bands);

}  // namespace touchstone::sim
