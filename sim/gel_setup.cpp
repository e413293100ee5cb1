#include <cstdlib>
#include <optional>
#include <system_error>

#include "core/error.h"
#include "fem/compliance_cache.h"
#include "fem/compliance_file.h"
#include "fem/setup_estimate.h"
#include "sim/gel_plan.h"
#include "sim/virtual_sensor.h"

namespace touchstone::sim {
namespace {

fem::SlabMesh slab_of(const DeviceSpec& device) {
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

std::shared_ptr<const fem::Compliance> set_up_gel(const DeviceSpec& device, const std::filesystem::path& cache_folder,
                                                  const Progress& progress) {
  const fem::SlabMesh slab = slab_of(device);
  const fem::ElasticMaterial material = material_of(device);
  const std::vector<fem::Bead> beads = beads_of(device);
  const std::optional<fem::ErrorGoal> goal = goal_of(device.mesh);
  return std::make_shared<const fem::Compliance>(
      goal ? fem::cached_compliance(slab, *goal, material, beads, cache_folder, progress)
           : fem::cached_compliance(slab, material, beads, cache_folder, progress));
}

GelPlan plan_gel(const DeviceSpec& device, const std::filesystem::path& cache_folder) {
  const fem::SlabMesh slab = slab_of(device);
  const fem::ElasticMaterial material = material_of(device);
  const std::vector<fem::Bead> beads = beads_of(device);
  const std::optional<fem::ErrorGoal> goal = goal_of(device.mesh);
  const std::string key =
      goal ? fem::compliance_key(slab, *goal, material, beads) : fem::compliance_key(slab, material, beads);
  GelPlan plan;
  plan.file = fem::compliance_file(cache_folder, key);
  fem::SlabMesh meshed = slab;
  std::error_code ignored;
  if (std::filesystem::exists(plan.file, ignored)) {
    try {
      const fem::Compliance gel = fem::read_compliance(plan.file, key);
      plan.ready = true;
      meshed.fine = gel.report.fine_edge;
      plan.surface_vertices = static_cast<double>(gel.vertices.size());
      plan.file_mb = static_cast<double>(std::filesystem::file_size(plan.file)) / 1e6;
      const double radius_per_edge = 1.0 / meshed.fine;
      plan.smooth_error = fem::errors_at(gel.mesh_error.smooth, radius_per_edge)[fem::ErrorOf::normal_force];
      plan.sharp_error = fem::errors_at(gel.mesh_error.sharp, radius_per_edge)[fem::ErrorOf::normal_force];
    } catch (const Error&) {
      // Set-up will say what is wrong with it, and make it anew.
    }
  }
  plan.sized = plan.ready || !goal;
  const fem::SetupEstimate estimate = fem::estimate_setup(meshed, static_cast<int>(beads.size()));
  plan.press_mb = estimate.press_bytes / 1e6;
  if (plan.ready) return plan;
  plan.surface_vertices = estimate.surface_vertices;
  plan.file_mb = estimate.file_bytes / 1e6;
  plan.setup_mb = estimate.setup_bytes / 1e6;
  return plan;
}

std::string describe(const GelPlan& plan) {
  const std::string file = plan.file.string();
  if (plan.ready) {
    return fmt::format(
        "gel: is set up, {:.0f} surface vertices, in {} ({:.0f} MB, shared by all processes)\n"
        "     the mesh makes a force err by {:.2g} % under a sphere and {:.2g} % under a sharp punch, at 1 mm of "
        "contact radius\n"
        "     a press takes up to {:.0f} MB more\n",
        plan.surface_vertices, file, plan.file_mb, 100.0 * plan.smooth_error, 100.0 * plan.sharp_error, plan.press_mb);
  }
  if (!plan.sized) {
    return fmt::format(
        "gel: will be set up with the mesh that meets its force_error, and kept in {} (at most {:.0f} MB)\n", file,
        72e-6 * fem::kMostSurfaceVertices * fem::kMostSurfaceVertices);
  }
  return fmt::format(
      "gel: will be set up once, about {:.0f} surface vertices, with some {:.0f} MB of memory, and kept in {} (about "
      "{:.0f} MB)\n"
      "     a press takes up to about {:.0f} MB more\n",
      plan.surface_vertices, plan.setup_mb, file, plan.file_mb, plan.press_mb);
}

}  // namespace touchstone::sim
