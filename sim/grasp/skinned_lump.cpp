#include "sim/grasp/skinned_lump.h"

#include <cmath>
#include <vector>

#include "core/error.h"
#include "core/number_checks.h"
#include "core/sha256.h"
#include "core/units.h"
#include "fem/error/compliance_cache.h"
#include "fem/vibration/vibration_cache.h"
#include "sim/grasp/gripped_face.h"
#include "sim/press/elastic_object.h"

namespace touchstone::sim {
namespace {

constexpr double kCoarsePerFine = 2.5;
constexpr double kFineDepth = 2.0;   // edges
constexpr double kFineRadius = 0.6;  // of the base: contacts are smaller

constexpr double kPlateModulus = 1e3;    // MPa, over a skin of 1
constexpr double kPlateEdge = 1.2;       // of the lump's
constexpr double kPlateThickness = 0.4;  // of the base's radius

std::vector<fem::ElasticMaterial> materials_of(const SkinnedLump& lump, double core_over_skin) {
  check_above_zero("a lump's ", core_over_skin, "core_over_skin");
  std::vector<fem::ElasticMaterial> materials = {{core_over_skin, lump.poisson_ratio}};
  if (lump.skin_mm > 0.0) materials.push_back({1.0, lump.poisson_ratio});
  return materials;
}

}  // namespace

fem::GelBody lump_body(const SkinnedLump& lump) {
  check_at_least_zero("a lump's ", lump.skin_mm, "skin_mm");
  fem::DomeGel dome;
  dome.sphere_radius = lump.sphere_radius_mm;
  dome.base_radius = lump.base_radius_mm;
  dome.thickness = lump.height_mm;
  dome.fine = lump.mesh_mm;
  dome.coarse = kCoarsePerFine * lump.mesh_mm;
  dome.fine_radius = kFineRadius * lump.base_radius_mm;
  dome.fine_depth = kFineDepth * lump.mesh_mm;
  if (lump.skin_mm > 0.0) dome.layers = {lump.skin_mm};
  fem::check(fem::GelBody(dome));
  return dome;
}

std::shared_ptr<const fem::Compliance> set_up_lump(const SkinnedLump& lump, double core_over_skin,
                                                   const std::filesystem::path& cache_folder) {
  const std::vector<fem::ElasticMaterial> materials = materials_of(lump, core_over_skin);
  const fem::GelBody body = lump_body(lump);
  // Without the ladder of meshes that a gel's own set-up measures its error by: that takes ten times as long.
  const std::string key = "lump " + fem::compliance_key(body, materials, {});
  Sha256 sum;
  sum.add(key);
  return std::make_shared<const fem::Compliance>(fem::cached_compliance(sum.digest(), cache_folder, [&] {
    fem::Compliance made = fem::compute_compliance(fem::mesh_gel(body), materials, {}, fem::thickness_of(body));
    made.report.fine_edge = fem::fine_edge(body);
    return made;
  }));
}

std::shared_ptr<const fem::Compliance> as_pressing_body(const SkinnedLump& lump, const fem::Compliance& piece,
                                                        double skin_MPa) {
  check_above_zero("a lump's ", skin_MPa, "skin_MPa");
  // The piece's first material is its core, whose modulus is that of the ratio.
  fem::Compliance stiff = fem::with_modulus(piece, skin_MPa * piece.material.youngs_modulus);
  return std::make_shared<const fem::Compliance>(turned_back(std::move(stiff), -lump.sphere_radius_mm));
}

std::shared_ptr<const fem::Compliance> set_up_plate(const SkinnedLump& lump,
                                                    const std::filesystem::path& cache_folder) {
  fem::SlabMesh pad;
  pad.size_x = pad.size_y = 2.0 * lump.base_radius_mm;
  pad.thickness = kPlateThickness * lump.base_radius_mm;
  pad.fine = kPlateEdge * lump.mesh_mm;
  pad.coarse = kCoarsePerFine * pad.fine;
  pad.fine_half_x = pad.fine_half_y = kFineRadius * lump.base_radius_mm;
  pad.fine_depth = pad.fine;
  const fem::ElasticMaterial hard{kPlateModulus, 0.3};
  Sha256 sum;
  sum.add("plate " + fem::compliance_key(pad, hard, {}));
  return std::make_shared<const fem::Compliance>(fem::cached_compliance(sum.digest(), cache_folder, [&] {
    return fem::compute_compliance(fem::mesh_slab(pad), hard, {}, pad.thickness);
  }));
}

fem::GelVibration set_up_lump_vibration(const SkinnedLump& lump, double core_over_skin, double density_kg_m3, int count,
                                        const std::filesystem::path& cache_folder) {
  const std::vector<fem::ElasticMaterial> materials = materials_of(lump, core_over_skin);
  const fem::GelBody body = lump_body(lump);
  return fem::cached_vibration(
      "lump " + fem::compliance_key(body, materials, {}), [&] { return fem::mesh_gel(body); }, materials, {},
      density_kg_m3 * kTonnePerMm3, count, cache_folder);
}

}  // namespace touchstone::sim
