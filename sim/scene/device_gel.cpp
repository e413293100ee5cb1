#include "sim/scene/device_gel.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/overloaded.h"
#include "fem/fine_relief/smooth_surface.h"
#include "sim/files/gltf_mesh.h"

namespace touchstone::sim {

fem::GelBody gel_body(const DeviceSpec& device) {
  const GelSpec& gel = device.gel;
  const MeshSpec& mesh = device.mesh;
  const Eigen::Vector2d& half = mesh.fine_half_extent_mm;
  std::vector<double> layers;
  for (const GelLayerSpec& layer : gel.layers) layers.push_back(layer.thickness_mm);
  return std::visit(
      Overloaded{[&](const SlabSpec& slab) -> fem::GelBody {
                   return fem::SlabGel{{slab.size_x_mm, slab.size_y_mm, gel.thickness_mm, mesh.fine_mm, mesh.coarse_mm,
                                        half.x(), half.y(), mesh.fine_depth_mm},
                                       layers};
                 },
                 [&](const DomeSpec& dome) -> fem::GelBody {
                   return fem::DomeGel{dome.sphere_radius_mm, dome.base_radius_mm, gel.thickness_mm,   mesh.fine_mm,
                                       mesh.coarse_mm,        half.maxCoeff(),     mesh.fine_depth_mm, layers};
                 },
                 [&](const FingertipSpec& tip) -> fem::GelBody {
                   return fem::FingertipGel{tip.radius_mm,  tip.length_mm,   tip.sleeve_mm,      mesh.fine_mm,
                                            mesh.coarse_mm, half.maxCoeff(), mesh.fine_depth_mm, layers};
                 },
                 [&](const GelMeshSpec& solid) -> fem::GelBody {
                   TS_ASSERT(solid.surface != nullptr);
                   return fem::SolidGel{
                       solid.surface->mesh, solid.surface->faces, mesh.fine_mm, mesh.coarse_mm, half.x(), half.y(),
                       mesh.fine_depth_mm};
                 }},
      gel.shape);
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

std::optional<RoundFace> round_face(const GelSpec& gel) {
  if (const DomeSpec* dome = gel.dome()) return RoundFace{dome->sphere_radius_mm, dome->base_radius_mm};
  if (const FingertipSpec* tip = gel.fingertip()) return RoundFace{tip->radius_mm, tip->radius_mm};
  return std::nullopt;
}

double rest_height(const GelSpec& gel, const Eigen::Vector2d& place) {
  TS_ASSERT(gel.mesh() == nullptr);
  const std::optional<RoundFace> face = round_face(gel);
  if (!face) return 0.0;
  const double sphere = face->sphere_radius_mm;
  const double across = std::min(place.norm(), face->radius_mm);
  return std::sqrt(sphere * sphere - across * across) - sphere;
}

namespace {

bool is_no_steeper(const GelSpec& gel, double slope) {
  const DomeSpec* dome = gel.dome();
  return gel.slab() != nullptr || (dome != nullptr && dome->base_radius_mm <= std::sin(slope) * dome->sphere_radius_mm);
}

}  // namespace

bool takes_fine_relief(const GelSpec& gel) {
  return is_no_steeper(gel, fem::kSteepestDome);
}

bool is_gentle(const GelSpec& gel) {
  constexpr double kGentle_rad = 0.5;
  return is_no_steeper(gel, kGentle_rad);
}

bool ends_on_plate(const GelSpec& gel) {
  constexpr double kRounding_mm = 1e-6;
  const DomeSpec* dome = gel.dome();
  return dome != nullptr && gel.thickness_mm + rest_height(gel, {dome->base_radius_mm, 0.0}) < kRounding_mm;
}

}  // namespace touchstone::sim
