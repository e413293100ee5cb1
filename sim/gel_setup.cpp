#include "sim/gel_setup.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <mutex>
#include <optional>

#include "core/error.h"
#include "core/units.h"
#include "fem/compliance_cache.h"
#include "fem/vibration_cache.h"
#include "sim/gltf_mesh.h"
#include "sim/virtual_sensor.h"

namespace touchstone::sim {
namespace {

constexpr int kModes = 80;  // of the vhs gel: to 1.5 kHz, three times the lowest

std::optional<fem::ErrorGoal> goal_of(const MeshSpec& mesh) {
  if (!mesh.force_error) return std::nullopt;
  return fem::ErrorGoal{*mesh.force_error, mesh.contact_radius_mm, mesh.sharp_bodies};
}

}  // namespace

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

std::shared_ptr<const fem::FiniteGel> set_up_finite_gel(const DeviceSpec& device) {
  const fem::GelBody body = gel_body(device);
  return std::make_shared<const fem::FiniteGel>(fem::mesh_gel(body), gel_materials(device.gel), gel_beads(device),
                                                fem::thickness_of(body));
}

double rest_height(const GelSpec& gel, const Eigen::Vector2d& place) {
  TS_ASSERT(gel.shape != GelShape::mesh);
  if (gel.shape == GelShape::slab) return 0.0;
  const bool dome = gel.shape == GelShape::dome;
  const double sphere = dome ? gel.sphere_radius_mm : gel.radius_mm;
  const double across = std::min(place.norm(), dome ? gel.base_radius_mm : gel.radius_mm);
  return std::sqrt(sphere * sphere - across * across) - sphere;
}

std::string gel_key(const DeviceSpec& device) {
  const fem::GelBody body = gel_body(device);
  const std::vector<fem::ElasticMaterial> materials = gel_materials(device.gel);
  const std::vector<fem::Bead> beads = gel_beads(device);
  const std::optional<fem::ErrorGoal> goal = goal_of(device.mesh);
  return goal ? fem::compliance_key(body, *goal, materials, beads) : fem::compliance_key(body, materials, beads);
}

void keep_gel_of_unit_modulus(const DeviceSpec& device, const std::filesystem::path& cache_folder,
                              const Progress& progress) {
  std::error_code ignored;
  if (cache_folder.empty() || !device.gel.layers.empty()) return;
  if (std::filesystem::exists(fem::compliance_file(cache_folder, gel_key(device)), ignored)) return;
  DeviceSpec relative = device;
  relative.gel.youngs_modulus_MPa = 1.0;
  set_up_gel(relative, cache_folder, progress);
}

std::shared_ptr<const fem::Compliance> set_up_gel(const DeviceSpec& device, const std::filesystem::path& cache_folder,
                                                  const Progress& progress) {
  const fem::GelBody body = gel_body(device);
  const std::vector<fem::ElasticMaterial> materials = gel_materials(device.gel);
  const std::vector<fem::Bead> beads = gel_beads(device);
  const std::optional<fem::ErrorGoal> goal = goal_of(device.mesh);
  return std::make_shared<const fem::Compliance>(
      goal ? fem::cached_compliance(body, *goal, materials, beads, cache_folder, progress)
           : fem::cached_compliance(body, materials, beads, cache_folder, progress));
}

std::shared_ptr<const fem::GelVibration> set_up_vibration(const SceneSpec& scene, const Plan& plan,
                                                          const std::filesystem::path& cache_folder) {
  if (!plan.inertia || scene.motion.highest_vibration_Hz() == 0.0) return nullptr;
  const DeviceSpec& device = scene.device;
  if (device.mesh.force_error) {
    fail_at(scene.where, "inertia needs a mesh that is given by fine_mm; effects.inertia: off leaves it out");
  }
  if (!device.gel.layers.empty()) {
    fail_at(scene.where, "the inertia of a gel with layers isn't simulated; effects.inertia: off leaves it out");
  }
  const fem::GelBody body = gel_body(device);
  const std::vector<fem::ElasticMaterial> materials = gel_materials(device.gel);
  const std::vector<fem::Bead> beads = gel_beads(device);
  // Scenes of one gel ask for the same modes at once: the first makes them, the others read them.
  static std::mutex one_at_a_time;
  const std::lock_guard lock(one_at_a_time);
  return std::make_shared<const fem::GelVibration>(fem::cached_vibration(
      fem::compliance_key(body, materials, beads), [&] { return fem::mesh_gel(body); }, materials, beads,
      device.gel.density_kg_m3 * kTonnePerMm3, kModes, cache_folder));
}

}  // namespace touchstone::sim
