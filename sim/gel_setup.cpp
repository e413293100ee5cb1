#include "sim/gel_setup.h"

#include <cstdlib>

#include "core/error.h"
#include "fem/compliance_cache.h"
#include "sim/gltf_mesh.h"
#include "sim/virtual_sensor.h"

namespace touchstone::sim {

std::filesystem::path default_cache_folder() {
  for (const auto& [variable, below] : {std::pair{"TOUCHSTONE_CACHE", ""}, std::pair{"XDG_CACHE_HOME", "touchstone"},
                                        std::pair{"HOME", ".cache/touchstone"}}) {
    const char* value = std::getenv(variable);
    if (value != nullptr && *value != '\0') return std::filesystem::path(value) / below;
  }
  return std::filesystem::temp_directory_path() / "touchstone-cache";
}

fem::GelBody gel_body(const DeviceSpec& device) {
  const GelSpec& gel = device.gel;
  const MeshSpec& mesh = device.mesh;
  const Eigen::Vector2d& half = mesh.fine_half_extent_mm;
  std::vector<double> layers;
  for (const GelLayerSpec& layer : gel.layers) layers.push_back(layer.thickness_mm);
  switch (gel.shape) {
    case GelShape::slab:
      return fem::SlabGel{{gel.size_x_mm, gel.size_y_mm, gel.thickness_mm, mesh.fine_mm, mesh.coarse_mm, half.x(),
                           half.y(), mesh.fine_depth_mm},
                          layers};
    case GelShape::dome:
      return fem::DomeGel{gel.sphere_radius_mm, gel.base_radius_mm, gel.thickness_mm,   mesh.fine_mm,
                          mesh.coarse_mm,       half.maxCoeff(),    mesh.fine_depth_mm, layers};
    case GelShape::fingertip:
      return fem::FingertipGel{gel.radius_mm,  gel.length_mm,   gel.sleeve_mm,      mesh.fine_mm,
                               mesh.coarse_mm, half.maxCoeff(), mesh.fine_depth_mm, layers};
    case GelShape::mesh:
      break;
  }
  TS_ASSERT(gel.surface != nullptr);
  return fem::SolidGel{gel.surface->mesh, gel.surface->faces, mesh.fine_mm,      mesh.coarse_mm,
                       half.x(),          half.y(),           mesh.fine_depth_mm};
}

std::vector<fem::ElasticMaterial> gel_materials(const GelSpec& gel) {
  std::vector<fem::ElasticMaterial> materials = {{gel.youngs_modulus_MPa, gel.poisson_ratio}};
  for (const GelLayerSpec& layer : gel.layers) materials.push_back({layer.youngs_modulus_MPa, layer.poisson_ratio});
  return materials;
}

std::vector<fem::Bead> gel_beads(const DeviceSpec& device) {
  std::vector<fem::Bead> beads;
  if (device.beads) {
    for (const Eigen::Vector3d& centre : bead_centres(*device.beads)) {
      beads.push_back({centre, device.beads->diameter_mm / 2});
    }
  }
  return beads;
}

std::shared_ptr<const fem::Compliance> set_up_gel(const DeviceSpec& device, const std::filesystem::path& cache_folder,
                                                  const Progress& progress) {
  return std::make_shared<const fem::Compliance>(
      fem::cached_compliance(gel_body(device), gel_materials(device.gel), gel_beads(device), cache_folder, progress));
}

}  // namespace touchstone::sim
