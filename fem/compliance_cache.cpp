#include "fem/compliance_cache.h"

#include <algorithm>
#include <system_error>

#include "core/error.h"
#include "core/sha256.h"
#include "fem/compliance_file.h"
#include "fem/mesh_error.h"

namespace touchstone::fem {
namespace {

/// Coarse edges over fine ones where the edges are found by a goal.
constexpr double kCoarsePerFine = 3.0;

SlabMesh with_fine(SlabMesh slab, double edge) {
  slab.fine = edge;
  slab.coarse = kCoarsePerFine * edge;
  return slab;
}

}  // namespace

std::string compliance_key(const SlabMesh& slab, const ElasticMaterial& material, std::span<const Bead> beads) {
  Sha256 sum;
  sum.add("touchstone compliance of a slab, format " + std::to_string(kComplianceFormat));
  const auto add = [&](double value) {
    value += 0.0;  // -0 and 0 are one gel
    sum.add(&value, sizeof(value));
  };
  for (const double value : {slab.size_x, slab.size_y, slab.thickness, slab.fine, slab.coarse, slab.fine_half_x,
                             slab.fine_half_y, slab.fine_depth, material.youngs_modulus, material.poisson_ratio}) {
    add(value);
  }
  for (const Bead& bead : beads) {
    add(bead.centre.x());
    add(bead.centre.y());
    add(bead.centre.z());
    add(bead.radius);
  }
  return sum.digest();
}

std::string compliance_key(const SlabMesh& slab, const ErrorGoal& goal, const ElasticMaterial& material,
                           std::span<const Bead> beads) {
  const SlabMesh free = with_fine(slab, 1.0);
  Sha256 sum;
  sum.add("edges by goal " + compliance_key(free, material, beads));
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

Compliance cached_compliance(const SlabMesh& slab, const ElasticMaterial& material, std::span<const Bead> beads,
                             const std::filesystem::path& cache_dir, const Progress& progress) {
  check(slab);
  check(material);
  return cached_compliance(compliance_key(slab, material, beads), cache_dir, [&] {
    Compliance gel = compute_compliance(mesh_slab(slab), material, beads, slab.thickness, progress);
    gel.report.fine_edge = slab.fine;
    gel.mesh_error = measure_mesh_error(gel, ladder_of(slab, material, beads), progress);
    return gel;
  });
}

Compliance cached_compliance(const SlabMesh& slab, const ErrorGoal& goal, const ElasticMaterial& material,
                             std::span<const Bead> beads, const std::filesystem::path& cache_dir,
                             const Progress& progress) {
  check(goal);
  check(material);
  if (goal.contact_radius > std::min(slab.fine_half_x, slab.fine_half_y)) {
    fail("the contact radius is {} mm; it must be within the finely meshed box's half extents, {} x {} mm",
         goal.contact_radius, slab.fine_half_x, slab.fine_half_y);
  }
  return cached_compliance(compliance_key(slab, goal, material, beads), cache_dir, [&] {
    GelOfEdge gel;
    gel.coarsest = std::min({slab.size_x, slab.size_y, slab.thickness}) / 2.0;
    gel.check = [&](double edge) { check(with_fine(slab, edge)); };
    gel.make = [&](double edge) {
      return compute_compliance(mesh_slab(with_fine(slab, edge)), material, beads, slab.thickness, progress);
    };
    gel.ladder = [&](double edge) { return ladder_of(with_fine(slab, edge), material, beads); };
    return gel_within(goal, gel, progress);
  });
}

}  // namespace touchstone::fem
