#include <cstdlib>
#include <mutex>

#include "core/units.h"
#include "fem/compliance_cache.h"
#include "fem/vibration_cache.h"
#include "sim/virtual_sensor.h"

namespace touchstone::sim {
namespace {

constexpr int kModes = 80;  // of the vhs gel: to 1.5 kHz, three times the lowest

}  // namespace

std::filesystem::path default_cache_folder() {
  for (const auto& [variable, below] : {std::pair{"TOUCHSTONE_CACHE", ""}, std::pair{"XDG_CACHE_HOME", "touchstone"},
                                        std::pair{"HOME", ".cache/touchstone"}}) {
    const char* value = std::getenv(variable);
    if (value != nullptr && *value != '\0') return std::filesystem::path(value) / below;
  }
  return std::filesystem::temp_directory_path() / "touchstone-cache";
}

GelParts gel_parts(const DeviceSpec& device) {
  const GelSpec& gel = device.gel;
  GelParts parts;
  parts.slab.size_x = gel.size_x_mm;
  parts.slab.size_y = gel.size_y_mm;
  parts.slab.thickness = gel.thickness_mm;
  parts.slab.fine = device.mesh.fine_mm;
  parts.slab.coarse = device.mesh.coarse_mm;
  parts.slab.fine_half_x = device.mesh.fine_half_extent_mm.x();
  parts.slab.fine_half_y = device.mesh.fine_half_extent_mm.y();
  parts.slab.fine_depth = device.mesh.fine_depth_mm;
  parts.material = {gel.youngs_modulus_MPa, gel.poisson_ratio};
  if (device.beads) {
    for (const Eigen::Vector3d& centre : bead_centres(*device.beads)) {
      parts.beads.push_back({centre, device.beads->diameter_mm / 2});
    }
  }
  parts.density = gel.density_kg_m3 * kTonnePerMm3;
  return parts;
}

std::shared_ptr<const fem::Compliance> set_up_gel(const DeviceSpec& device, const std::filesystem::path& cache_folder,
                                                  const Progress& progress) {
  const GelParts gel = gel_parts(device);
  return std::make_shared<const fem::Compliance>(
      fem::cached_compliance(gel.slab, gel.material, gel.beads, cache_folder, progress));
}

std::shared_ptr<const fem::GelVibration> set_up_vibration(const SceneSpec& scene, const Plan& plan,
                                                          const std::filesystem::path& cache_folder) {
  if (!plan.inertia || scene.motion.highest_vibration_Hz() == 0.0) return nullptr;
  const GelParts gel = gel_parts(scene.device);
  // Scenes of one gel ask for the same modes at once: the first makes them, the others read them.
  static std::mutex one_at_a_time;
  const std::lock_guard lock(one_at_a_time);
  return std::make_shared<const fem::GelVibration>(fem::cached_vibration(
      fem::compliance_key(gel.slab, gel.material, gel.beads), [&] { return fem::mesh_slab(gel.slab); }, gel.material,
      gel.beads, gel.density, kModes, cache_folder));
}

}  // namespace touchstone::sim
