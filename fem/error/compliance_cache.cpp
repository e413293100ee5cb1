#include "fem/error/compliance_cache.h"

#include <algorithm>
#include <system_error>

#include "core/error.h"
#include "core/sha256.h"
#include "fem/elements/compliance_file.h"
#include "fem/error/mesh_error.h"

namespace touchstone::fem {
namespace {

/// Coarse edges over fine ones where the edges are found by a goal.
constexpr double kCoarsePerFine = 3.0;

GelBody with_fine(const GelBody& body, double edge) {
  return with_edges(body, edge, kCoarsePerFine * edge);
}

void check_materials(const GelBody& body, std::span<const ElasticMaterial> materials) {
  for (const ElasticMaterial& material : materials) check(material);
  if (static_cast<int>(materials.size()) != material_count(body)) {
    fail("the gel takes {} materials, but {} are given", material_count(body), materials.size());
  }
}

/// The gel of `key`, made from the one whose body has 1 MPa (`unit_key`), which is read if the cache has it, else made.
/// All gels come from that one, so that their bytes don't depend on what the cache has.
Compliance from_unit_modulus(const std::string& key, const std::string& unit_key, double youngs_modulus,
                             const std::filesystem::path& cache_dir, const std::function<Compliance()>& make_unit) {
  const auto unit = [&] {
    const std::filesystem::path path = compliance_file(cache_dir, unit_key);
    std::error_code ignored;
    if (cache_dir.empty() || !std::filesystem::exists(path, ignored)) return make_unit();
    try {
      return read_compliance(path, unit_key);
    } catch (const Error&) {
      return make_unit();  // who asks for that gel itself gets the error, and has the file replaced
    }
  };
  return cached_compliance(key, cache_dir, [&] { return with_modulus(unit(), youngs_modulus); });
}

}  // namespace

std::vector<ElasticMaterial> per_body_modulus(std::span<const ElasticMaterial> materials) {
  std::vector<ElasticMaterial> relative(materials.begin(), materials.end());
  for (ElasticMaterial& material : relative) material.youngs_modulus /= materials.front().youngs_modulus;
  return relative;
}

std::string compliance_key(const GelBody& body, std::span<const ElasticMaterial> materials,
                           std::span<const Bead> beads) {
  Sha256 sum;
  sum.add("touchstone compliance of a gel, format " + std::to_string(kComplianceFormat));
  add_to(sum, body);
  const auto add = [&](double value) {
    value += 0.0;  // -0 and 0 are one gel
    sum.add(&value, sizeof(value));
  };
  add(static_cast<double>(materials.size()));
  for (const ElasticMaterial& material : materials) {
    add(material.youngs_modulus);
    add(material.poisson_ratio);
  }
  for (const Bead& bead : beads) {
    add(bead.centre.x());
    add(bead.centre.y());
    add(bead.centre.z());
    add(bead.radius);
  }
  return sum.digest();
}

std::string compliance_key(const SlabMesh& slab, const ElasticMaterial& material, std::span<const Bead> beads) {
  return compliance_key(SlabGel{slab, {}}, std::span(&material, 1), beads);
}

std::string compliance_key(const GelBody& body, const ErrorGoal& goal, std::span<const ElasticMaterial> materials,
                           std::span<const Bead> beads) {
  Sha256 sum;
  sum.add("edges by goal " + compliance_key(with_fine(body, 1.0), materials, beads));
  for (const double value : {goal.force_error, goal.contact_radius, goal.sharp_bodies ? 1.0 : 0.0}) {
    sum.add(&value, sizeof(value));
  }
  return sum.digest();
}

std::filesystem::path compliance_file(const std::filesystem::path& cache_dir, const std::string& key) {
  return cache_dir / ("compliance-" + key + ".bin");
}

Compliance cached_compliance(const std::string& key, const std::filesystem::path& cache_dir,
                             const std::function<Compliance()>& make) {
  if (cache_dir.empty()) return make();
  const std::filesystem::path path = compliance_file(cache_dir, key);
  std::string note;
  std::error_code ignored;
  if (std::filesystem::exists(path, ignored)) {
    try {
      return read_compliance(path, key);
    } catch (const Error& error) {
      note = fmt::format("the cached compliance {} was made anew: {}", path.string(), error.what());
    }
  }
  Compliance gel = make();
  try {
    std::filesystem::create_directories(cache_dir, ignored);
    write_compliance(path, key, gel);
    gel = read_compliance(path, key);  // shared with other processes from here on, and seen to be sound
  } catch (const std::exception& error) {
    note += fmt::format("{}the compliance couldn't be kept: {}", note.empty() ? "" : "; ", error.what());
  }
  gel.report.note = note;
  return gel;
}

Compliance cached_compliance(const GelBody& body, std::span<const ElasticMaterial> materials,
                             std::span<const Bead> beads, const std::filesystem::path& cache_dir,
                             const Progress& progress) {
  check(body);
  check_materials(body, materials);
  const std::vector<ElasticMaterial> relative = per_body_modulus(materials);
  const auto make = [&] {
    Compliance gel = compute_compliance(mesh_gel(body), relative, beads, thickness_of(body), progress);
    gel.report.fine_edge = fine_edge(body);
    gel.mesh_error = measure_mesh_error(gel, ladder_of(body, relative, beads), progress);
    return gel;
  };
  return from_unit_modulus(compliance_key(body, materials, beads), compliance_key(body, relative, beads),
                           materials.front().youngs_modulus, cache_dir, make);
}

Compliance cached_compliance(const SlabMesh& slab, const ElasticMaterial& material, std::span<const Bead> beads,
                             const std::filesystem::path& cache_dir, const Progress& progress) {
  return cached_compliance(SlabGel{slab, {}}, std::span(&material, 1), beads, cache_dir, progress);
}

Compliance cached_compliance(const GelBody& body, const ErrorGoal& goal, std::span<const ElasticMaterial> materials,
                             std::span<const Bead> beads, const std::filesystem::path& cache_dir,
                             const Progress& progress) {
  check(goal);
  check_materials(body, materials);
  if (goal.contact_radius > fine_reach(body)) {
    fail("the contact radius is {} mm; it must be within the finely meshed part, {} mm from its middle",
         goal.contact_radius, fine_reach(body));
  }
  const std::vector<ElasticMaterial> relative = per_body_modulus(materials);
  const auto make = [&] {
    GelOfEdge gel;
    gel.coarsest = least_extent(body) / 2.0;
    gel.check = [&](double edge) { check(with_fine(body, edge)); };
    gel.make = [&](double edge) {
      return compute_compliance(mesh_gel(with_fine(body, edge)), relative, beads, thickness_of(body), progress);
    };
    gel.ladder = [&](double edge) { return ladder_of(with_fine(body, edge), relative, beads); };
    return gel_within(goal, gel, progress);
  };
  return from_unit_modulus(compliance_key(body, goal, materials, beads), compliance_key(body, goal, relative, beads),
                           materials.front().youngs_modulus, cache_dir, make);
}

}  // namespace touchstone::fem
