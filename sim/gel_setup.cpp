#include <cstdlib>

#include "fem/compliance_cache.h"
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

std::shared_ptr<const fem::Compliance> set_up_gel(const DeviceSpec& device, const std::filesystem::path& cache_folder,
                                                  const Progress& progress) {
  const GelSpec& gel = device.gel;
  fem::SlabMesh mesh;
  mesh.size_x = gel.size_x_mm;
  mesh.size_y = gel.size_y_mm;
  mesh.thickness = gel.thickness_mm;
  mesh.fine = device.mesh.fine_mm;
  mesh.coarse = device.mesh.coarse_mm;
  mesh.fine_half_x = device.mesh.fine_half_extent_mm.x();
  mesh.fine_half_y = device.mesh.fine_half_extent_mm.y();
  mesh.fine_depth = device.mesh.fine_depth_mm;
  std::vector<fem::Bead> beads;
  if (device.beads) {
    for (const Eigen::Vector3d& centre : bead_centres(*device.beads)) {
      beads.push_back({centre, device.beads->diameter_mm / 2});
    }
  }
  if (device.mesh.force_error) {
    const fem::ErrorGoal goal{*device.mesh.force_error, device.mesh.contact_radius_mm, device.mesh.sharp_bodies};
    return std::make_shared<const fem::Compliance>(
        fem::cached_compliance(mesh, goal, {gel.youngs_modulus_MPa, gel.poisson_ratio}, beads, cache_folder, progress));
  }
  return std::make_shared<const fem::Compliance>(
      fem::cached_compliance(mesh, {gel.youngs_modulus_MPa, gel.poisson_ratio}, beads, cache_folder, progress));
}

}  // namespace touchstone::sim
