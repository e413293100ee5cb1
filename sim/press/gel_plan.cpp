#include "sim/press/gel_plan.h"

#include <system_error>

#include "core/error.h"
#include "fem/elements/compliance_file.h"
#include "fem/error/compliance_cache.h"
#include "fem/error/setup_estimate.h"
#include "sim/press/gel_setup.h"
#include "sim/scene/device_gel.h"

namespace touchstone::sim {

GelPlan plan_gel(const DeviceSpec& device, const std::filesystem::path& cache_folder) {
  const fem::GelBody body = gel_body(device);
  const std::string key = gel_key(device);
  GelPlan plan;
  plan.file = fem::compliance_file(cache_folder, key);
  double edge = fem::fine_edge(body);
  std::error_code ignored;
  if (std::filesystem::exists(plan.file, ignored)) {
    try {
      const fem::Compliance gel = fem::read_compliance(plan.file, key);
      plan.ready = true;
      edge = gel.report.fine_edge;
      plan.surface_vertices = static_cast<double>(gel.vertices.size());
      plan.compression_error = gel.report.compression_error;
      plan.file_mb = static_cast<double>(std::filesystem::file_size(plan.file)) / 1e6;
      const double radius_per_edge = 1.0 / edge;
      plan.smooth_error = fem::errors_at(gel.mesh_error.smooth, radius_per_edge)[fem::ErrorOf::normal_force];
      plan.sharp_error = fem::errors_at(gel.mesh_error.sharp, radius_per_edge)[fem::ErrorOf::normal_force];
    } catch (const Error&) {
      // Set-up will say what is wrong with it, and make it anew.
    }
  }
  const auto* slab = std::get_if<fem::SlabGel>(&body);
  plan.sized = plan.ready || (slab != nullptr && !device.mesh.force_error);
  plan.press_mb = fem::press_bytes(edge, fem::fine_reach(body)) / 1e6;
  if (plan.ready || !plan.sized) return plan;
  const fem::SetupEstimate estimate = fem::estimate_setup(slab->mesh, static_cast<int>(gel_beads(device).size()));
  plan.surface_vertices = estimate.surface_vertices;
  plan.file_mb = estimate.file_bytes / 1e6;
  plan.setup_mb = estimate.setup_bytes / 1e6;
  return plan;
}

std::string describe(const GelPlan& plan) {
  const std::string file = plan.file.string();
  if (plan.ready) {
    const std::string compressed =
        plan.compression_error > 0.0
            ? fmt::format(
                  "     far parts of its compliance are compressed; all in all that leaves out {:.1g} of its mean "
                  "diagonal\n",
                  plan.compression_error)
            : "";
    return fmt::format(
        "gel: is set up, {:.0f} surface vertices, in {} ({:.0f} MB, shared by all processes)\n"
        "{}"
        "     the mesh makes a force err by {:.2g} % under a sphere and {:.2g} % under a sharp punch, at 1 mm of "
        "contact radius\n"
        "     a press takes up to {:.0f} MB more\n",
        plan.surface_vertices, file, plan.file_mb, compressed, 100.0 * plan.smooth_error, 100.0 * plan.sharp_error,
        plan.press_mb);
  }
  if (!plan.sized) {
    return fmt::format(
        "gel: will be set up once, with a mesh whose size isn't known before, and kept in {} (at most {:.0f} MB)\n",
        file, 72e-6 * fem::kMostWholeVertices * fem::kMostWholeVertices);
  }
  return fmt::format(
      "gel: will be set up once, about {:.0f} surface vertices, with some {:.0f} MB of memory, and kept in {} (about "
      "{:.0f} MB)\n"
      "     a press takes up to about {:.0f} MB more\n",
      plan.surface_vertices, plan.setup_mb, file, plan.file_mb, plan.press_mb);
}

}  // namespace touchstone::sim
