#include "sim/scene/device_gel.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "fem/fine_relief/smooth_surface.h"
#include "sim/files/gltf_mesh.h"

namespace touchstone::sim {

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

double rest_height(const GelSpec& gel, const Eigen::Vector2d& place) {
  TS_ASSERT(gel.shape != GelShape::mesh);
  if (gel.shape == GelShape::slab) return 0.0;
  const bool dome = gel.shape == GelShape::dome;
  const double sphere = dome ? gel.sphere_radius_mm : gel.radius_mm;
  const double across = std::min(place.norm(), dome ? gel.base_radius_mm : gel.radius_mm);
  return std::sqrt(sphere * sphere - across * across) - sphere;
}

bool is_gentle(const GelSpec& gel) {
  return gel.shape == GelShape::slab ||
         (gel.shape == GelShape::dome && gel.base_radius_mm <= std::sin(fem::kSteepestDome) * gel.sphere_radius_mm);
}

}  // namespace touchstone::sim
