#include "sim/cost/setup_cost.h"

#include <system_error>

#include "fem/elements/surface_coupling.h"
#include "fem/error/compliance_cache.h"
#include "fem/error/setup_estimate.h"
#include "sim/press/elastic_object.h"
#include "sim/press/gel_setup.h"
#include "sim/scene/device_gel.h"

namespace touchstone::sim {
namespace {

double seconds_of(const fem::EliminationCount& count, const MachineRates& rates) {
  return rates.elimination_s * count.operations + rates.unknown_s * count.unknowns;
}

}  // namespace

std::optional<double> gel_setup_seconds(const DeviceSpec& device, const MachineRates& rates,
                                        const std::filesystem::path& cache) {
  const fem::GelBody body = gel_body(device);
  const std::vector<fem::ElasticMaterial> materials = gel_materials(device.gel);
  const std::vector<fem::Bead> beads = gel_beads(device);
  DeviceSpec relative = device;
  if (relative.gel.layers.empty()) relative.gel.youngs_modulus_MPa = 1.0;
  std::error_code ignored;
  for (const DeviceSpec* one : {&device, static_cast<const DeviceSpec*>(&relative)}) {
    if (!cache.empty() && std::filesystem::exists(fem::compliance_file(cache, gel_key(*one)), ignored)) return 0.0;
  }
  if (device.mesh.force_error) return std::nullopt;
  const fem::SetupCount count = fem::count_setup(body, fem::per_body_modulus(materials), beads);
  const bool flat = std::holds_alternative<fem::SlabGel>(body);
  return seconds_of(count.eliminations, rates) + (flat ? rates.flat_press_s : rates.curved_press_s) * count.presses;
}

double elastic_setup_seconds(const ObjectSpec& object, const MachineRates& rates) {
  const fem::ElasticMaterial material{object.elastic.value().youngs_modulus_MPa, object.elastic->poisson_ratio};
  return seconds_of(fem::count_elimination(fem::mesh_gel(solid_of(object)), std::span(&material, 1), {}), rates);
}

double gel_factorisation_operations(const DeviceSpec& device) {
  return fem::count_factorisation(fem::mesh_gel(gel_body(device)), gel_materials(device.gel));
}

fem::Compliance unpressed_gel(const DeviceSpec& device) {
  const fem::GelBody body = gel_body(device);
  const fem::TetMesh mesh = fem::mesh_gel(body);
  const fem::OuterSurface surface = fem::outer_surface(mesh);
  fem::Compliance gel;
  gel.thickness = fem::thickness_of(body);
  gel.material = gel_materials(device.gel).front();
  for (const int vertex : surface.mesh_vertex) gel.vertices.push_back(mesh.vertices[static_cast<std::size_t>(vertex)]);
  gel.triangles = surface.triangles;
  gel.mass = fem::surface_mass(mesh, surface);
  return gel;
}

}  // namespace touchstone::sim
