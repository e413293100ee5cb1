#include "sim/press/linear_range.h"

#include "core/error.h"
#include "sim/press/gel_setup.h"
#include "sim/scene/object.h"
#include "sim/scene/scene.h"

namespace touchstone::sim {

std::vector<fem::LinearRangeRow> measure_linear_range(const SceneSpec& scene, const std::filesystem::path& cache_folder,
                                                      const Progress& progress) {
  if (scene.device.mesh.force_error) {
    fail_at(scene.where, "finite strain needs a mesh that is given by fine_mm: {} gives it by force_error",
            scene.device.name);
  }
  const auto linear = set_up_gel(scene.device, cache_folder, progress);
  const auto gel = set_up_finite_gel(scene.device);
  return fem::measure_linear_range(*linear, *gel, coarse_contact_shape(scene.object, scene.device.mesh.fine_mm),
                                   scene.object.friction, fem::kRangeDepths, progress);
}

}  // namespace touchstone::sim
