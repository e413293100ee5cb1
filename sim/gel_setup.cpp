#include <cstdlib>
#include <mutex>

#include "core/units.h"
#include "fem/compliance_cache.h"
#include "fem/vibration_cache.h"
#include "sim/virtual_sensor.h"

namespace touchstone::sim {
namespace {

constexpr int kModes = 80;  // of the vhs gel: to 1.5 kHz, three times the lowest

fem::SlabMesh slab_of(const DeviceSpec& device) {
  fem::SlabMesh mesh;
  mesh.size_x = device.gel.size_x_mm;
  mesh.size_y = device.gel.size_y_mm;
  mesh.thickness = device.gel.thickness_mm;
  mesh.fine = device.mesh.fine_mm;
  mesh.coarse = device.mesh.coarse_mm;
  mesh.fine_half_x = device.mesh.fine_half_extent_mm.x();
  mesh.fine_half_y = device.mesh.fine_half_extent_mm.y();
  mesh.fine_depth = device.mesh.fine_depth_mm;
  return mesh;
}

fem::ElasticMaterial material_of(const DeviceSpec& device) {
  return {device.gel.youngs_modulus_MPa, device.gel.poisson_ratio};
}

std::vector<fem::Bead> beads_of(const DeviceSpec& device) {
  std::vector<fem::Bead> beads;
  if (device.beads) {
    for (const Eigen::Vector3d& centre : bead_centres(*device.beads)) {
      beads.push_back({centre, device.beads->diameter_mm / 2});
    }
  }
  return beads;
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

std::shared_ptr<const fem::Compliance> set_up_gel(const DeviceSpec& device, const std::filesystem::path& cache_folder,
                                                  const Progress& progress) {
  return std::make_shared<const fem::Compliance>(
      fem::cached_compliance(slab_of(device), material_of(device), beads_of(device), cache_folder, progress));
}

std::shared_ptr<const fem::GelVibration> set_up_vibration(const SceneSpec& scene, const Plan& plan,
                                                          const std::filesystem::path& cache_folder) {
  if (!plan.inertia || scene.motion.highest_vibration_Hz() == 0.0) return nullptr;
  const DeviceSpec& device = scene.device;
  const fem::SlabMesh slab = slab_of(device);
  const auto beads = beads_of(device);
  // Scenes of one gel ask for the same modes at once: the first makes them, the others read them.
  static std::mutex one_at_a_time;
  const std::lock_guard lock(one_at_a_time);
  return std::make_shared<const fem::GelVibration>(fem::cached_vibration(
      fem::compliance_key(slab, material_of(device), beads), [&] { return mesh_slab(slab); }, material_of(device),
      beads, device.gel.density_kg_m3 * kTonnePerMm3, kModes, cache_folder));
}

}  // namespace touchstone::sim
