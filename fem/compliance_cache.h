#pragma once
// Compliances on disk: made once for each gel, read back in a fraction of a second.

#include <filesystem>
#include <span>
#include <string>

#include "core/progress.h"
#include "fem/compliance.h"
#include "fem/gel_body.h"

namespace touchstone::fem {

/// Raised with each change of the file's layout, or of how a compliance is computed.
inline constexpr int kComplianceFormat = 1;

/// SHA-256 of all that a compliance depends on: shape and mesh parameters, materials, beads, kComplianceFormat.
std::string compliance_key(const GelBody& body, std::span<const ElasticMaterial> materials,
                           std::span<const Bead> beads);
std::string compliance_key(const SlabMesh& slab, const ElasticMaterial& material, std::span<const Bead> beads);

/// Where it is kept: `compliance-<key>.bin`.
std::filesystem::path compliance_file(const std::filesystem::path& cache_dir, const std::string& key);

/// The gel's compliance, from the cache if a sound file is there, else computed and kept. What is read is bit for bit
/// what was computed. A file that is truncated, changed, of another format or another key is never used: the compliance
/// is made anew, the file replaced, and `report.note` says why in one sentence; it also says so if the file can't be
/// written. An empty `cache_dir` keeps nothing. `materials`: the body's, then the layers' from the outer surface
/// inwards (material_count). @throws Error as mesh_gel() and compute_compliance() do
Compliance cached_compliance(const GelBody& body, std::span<const ElasticMaterial> materials,
                             std::span<const Bead> beads, const std::filesystem::path& cache_dir,
                             const Progress& progress = {});
/// The same for a slab of one material.
Compliance cached_compliance(const SlabMesh& slab, const ElasticMaterial& material, std::span<const Bead> beads,
                             const std::filesystem::path& cache_dir, const Progress& progress = {});

}  // namespace touchstone::fem
