#include "fem/vibration/vibration_cache.h"

#include <iterator>
#include <string_view>
#include <system_error>

#include "core/error.h"
#include "core/matrix_file.h"
#include "core/sha256.h"
#include "core/whole_file.h"

namespace touchstone::fem {
namespace {

constexpr std::string_view kMagic = "TSVIBRAT";  // of a matrix file (core/matrix_file.h)

std::string key_of(const std::string& gel_key, double density, int count) {
  Sha256 sum;
  sum.add("touchstone vibration, format " + std::to_string(kVibrationFormat) + ", of " + gel_key);
  sum.add(&density, sizeof(density));
  sum.add(&count, sizeof(count));
  return sum.digest();
}

std::string file_of(const std::string& key, const GelVibration& vibration) {
  return matrix_file(kMagic, key,
                     {vibration.angular_frequency, vibration.surface, vibration.beads, vibration.effective_mass,
                      Eigen::MatrixXd::Constant(1, 1, vibration.mass)});
}

/// @throws Error that says, as the second half of a sentence, why the file can't be used
GelVibration read_file(const std::filesystem::path& path, const std::string& key, Eigen::Index beads, int count) {
  const std::string content = read_whole_file(path);
  MatrixFile matrices(content, kMagic, "a gel's modes", key, "gel");
  GelVibration vibration;
  const Eigen::MatrixXd frequency = matrices.take();
  vibration.surface = matrices.take();
  vibration.beads = matrices.take();
  vibration.effective_mass = matrices.take();
  const Eigen::MatrixXd mass = matrices.take();
  if (!matrices.rest().empty() || frequency.cols() != 1 || frequency.rows() != count ||
      vibration.surface.cols() != count || vibration.beads.cols() != count ||
      vibration.effective_mass.cols() != count || mass.size() != 1 || vibration.surface.rows() % 3 != 0 ||
      vibration.beads.rows() != 3 * beads || vibration.effective_mass.rows() != 3) {
    fail("its matrices don't fit each other");
  }
  if (!(frequency.array() > 0.0).all() || !frequency.allFinite() || !vibration.surface.allFinite() ||
      !vibration.beads.allFinite() || !vibration.effective_mass.allFinite() || !mass.allFinite()) {
    fail("it has numbers that aren't a vibration's");
  }
  vibration.angular_frequency = frequency;
  vibration.mass = mass(0, 0);
  return vibration;
}

}  // namespace

std::filesystem::path vibration_file(const std::filesystem::path& cache_dir, const std::string& gel_key, double density,
                                     int count) {
  return cache_dir / ("vibration-" + key_of(gel_key, density, count) + ".bin");
}

GelVibration cached_vibration(const std::string& gel_key, const std::function<TetMesh()>& mesh,
                              std::span<const ElasticMaterial> materials, std::span<const Bead> beads, double density,
                              int count, const std::filesystem::path& cache_dir) {
  const std::string key = key_of(gel_key, density, count);
  const std::filesystem::path path = vibration_file(cache_dir, gel_key, density, count);
  const bool keep = !cache_dir.empty();
  std::string note;
  std::error_code ignored;
  if (keep && std::filesystem::exists(path, ignored)) {
    try {
      return read_file(path, key, std::ssize(beads), count);
    } catch (const Error& error) {
      note = fmt::format("the cached modes {} were made anew: {}", path.string(), error.what());
    }
  }
  GelVibration vibration = compute_vibration(mesh(), materials, beads, density, count);
  if (keep) {
    try {
      std::filesystem::create_directories(cache_dir, ignored);
      write_whole_file(path, file_of(key, vibration));
    } catch (const std::exception& error) {
      note += fmt::format("{}the modes couldn't be kept: {}", note.empty() ? "" : "; ", error.what());
    }
  }
  vibration.note = note;
  return vibration;
}

}  // namespace touchstone::fem
