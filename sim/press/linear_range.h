#pragma once

#include <filesystem>
#include <vector>

#include "core/progress.h"
#include "fem/finite_strain/linear_range.h"
#include "sim/scene/scene.h"

namespace touchstone::sim {

/// How far the forces of linear elasticity serve in a scene: fem::measure_linear_range for its device's gel and its
/// (first) object, with the object's friction. Sets the gel up where the cache doesn't have it.
/// @throws Error if the mesh isn't given by fine_mm or the object isn't over the gel's middle
std::vector<fem::LinearRangeRow> measure_linear_range(const SceneSpec& scene, const std::filesystem::path& cache_folder,
                                                      const Progress& progress = {});

}  // namespace touchstone::sim
