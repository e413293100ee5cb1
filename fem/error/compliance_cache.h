#pragma once
// Compliances on disk: made once for each gel, read back in milliseconds.

#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "core/progress.h"
#include "fem/elements/compliance.h"
#include "fem/error/mesh_goal.h"
#include "fem/mesh/gel_body.h"

namespace touchstone::fem {

/// SHA-256 of all that a compliance depends on: shape and mesh parameters, materials, beads, kComplianceFormat (see
/// fem/elements/compliance_file.h).
std::string compliance_key(const GelBody& body, std::span<const ElasticMaterial> materials,
                           std::span<const Bead> beads);
std::string compliance_key(const SlabMesh& slab, const ElasticMaterial& material, std::span<const Bead> beads);

/// Where it is kept: `compliance-<key>.bin`.
std::filesystem::path compliance_file(const std::filesystem::path& cache_dir, const std::string& key);

/// The compliance of this key, from the cache if a sound file is there, else from `make`, and kept. What is read is bit
/// for bit what was made; its matrices stay in the mapped file (see SharedMatrix), which all processes share. A file
/// that is truncated, changed, of another format or another key is never used: the compliance is made anew, the file
/// replaced, and `report.note` says why in one sentence; it also says so if the file can't be written. Two processes
/// may make the same one at once: the last to end leaves its file, whole. An empty `cache_dir` keeps nothing.
/// @throws what `make` throws
Compliance cached_compliance(const std::string& key, const std::filesystem::path& cache_dir,
                             const std::function<Compliance()>& make);

/// The materials with the first one's modulus as the unit: 1, and the others' over it.
std::vector<ElasticMaterial> per_body_modulus(std::span<const ElasticMaterial> materials);

/// The gel's compliance with its table of mesh errors in the same way. `materials`: the body's, then the layers' from
/// the outer surface inwards (material_count). Gels that differ in one factor of all moduli differ in a factor: if the
/// one of per_body_modulus() is in the cache, this one is made from it in a moment, with the same bytes as without.
/// @throws Error as mesh_gel() and compute_compliance() do
Compliance cached_compliance(const GelBody& body, std::span<const ElasticMaterial> materials,
                             std::span<const Bead> beads, const std::filesystem::path& cache_dir,
                             const Progress& progress = {});
/// The same for a slab of one material.
Compliance cached_compliance(const SlabMesh& slab, const ElasticMaterial& material, std::span<const Bead> beads,
                             const std::filesystem::path& cache_dir, const Progress& progress = {});

/// The gel's compliance with edges that meet a goal instead of its own: the fine one is chosen, the coarse one three
/// times that. Kept under the goal, so that the search isn't repeated. @throws Error as gel_within() does
Compliance cached_compliance(const GelBody& body, const ErrorGoal& goal, std::span<const ElasticMaterial> materials,
                             std::span<const Bead> beads, const std::filesystem::path& cache_dir,
                             const Progress& progress = {});

/// The key of that.
std::string compliance_key(const GelBody& body, const ErrorGoal& goal, std::span<const ElasticMaterial> materials,
                           std::span<const Bead> beads);

}  // namespace touchstone::fem
