#pragma once
// A gel's modes on disk: half a minute to make, milliseconds to read.

#include <filesystem>
#include <functional>
#include <span>
#include <string>

#include "fem/vibration/vibration.h"

namespace touchstone::fem {

/// Raised with each change of the file's layout, or of how modes are computed.
inline constexpr int kVibrationFormat = 1;

/// Where the modes of the gel under `gel_key` (compliance_key: mesh, material, beads) are kept:
/// `vibration-<SHA-256 of that, density, count and format>.bin`.
std::filesystem::path vibration_file(const std::filesystem::path& cache_dir, const std::string& gel_key, double density,
                                     int count);

/// compute_vibration, from the cache if a sound file is there, else computed and kept. What is read is bit for bit what
/// was computed. `mesh` is called only if needed. A file that is truncated, changed or of another key is never used:
/// the modes are made anew, and GelVibration::note says why. An empty `cache_dir` keeps nothing.
/// @throws Error as mesh() and compute_vibration() do
GelVibration cached_vibration(const std::string& gel_key, const std::function<TetMesh()>& mesh,
                              std::span<const ElasticMaterial> materials, std::span<const Bead> beads, double density,
                              int count, const std::filesystem::path& cache_dir);

}  // namespace touchstone::fem
