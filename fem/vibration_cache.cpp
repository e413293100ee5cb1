#include "fem/vibration_cache.h"

#include <bit>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <system_error>

#include "core/error.h"
#include "core/sha256.h"
#include "core/whole_file.h"

namespace touchstone::fem {
namespace {

// A file is: kMagic, the key (64 hexadecimal digits), the matrices, and the SHA-256 of all before it (64 hexadecimal
// digits). A matrix is its rows and columns (int64) and its numbers by columns, little-endian.
static_assert(std::endian::native == std::endian::little);
constexpr std::string_view kMagic = "TSVIBRAT";
constexpr std::size_t kDigestSize = 64;

std::string key_of(const std::string& gel_key, double density, int count) {
  Sha256 sum;
  sum.add("touchstone vibration, format " + std::to_string(kVibrationFormat) + ", of " + gel_key);
  sum.add(&density, sizeof(density));
  sum.add(&count, sizeof(count));
  return sum.digest();
}

void put(std::string& bytes, const Eigen::MatrixXd& matrix) {
  const std::int64_t size[2] = {matrix.rows(), matrix.cols()};
  bytes.append(reinterpret_cast<const char*>(size), sizeof(size));
  bytes.append(reinterpret_cast<const char*>(matrix.data()), sizeof(double) * static_cast<std::size_t>(matrix.size()));
}

Eigen::MatrixXd take(std::string_view& bytes) {
  std::int64_t size[2];
  if (bytes.size() < sizeof(size)) fail("it ends early");
  std::memcpy(size, bytes.data(), sizeof(size));
  bytes.remove_prefix(sizeof(size));
  const std::size_t numbers = bytes.size() / sizeof(double);
  if (size[0] < 0 || size[1] < 0 ||
      (size[1] > 0 && static_cast<std::size_t>(size[0]) > numbers / static_cast<std::size_t>(size[1]))) {
    fail("it ends early");
  }
  Eigen::MatrixXd matrix(size[0], size[1]);
  const std::size_t length = sizeof(double) * static_cast<std::size_t>(matrix.size());
  if (length > 0) std::memcpy(matrix.data(), bytes.data(), length);
  bytes.remove_prefix(length);
  return matrix;
}

std::string file_of(const std::string& key, const GelVibration& vibration) {
  std::string bytes(kMagic);
  bytes += key;
  for (const Eigen::MatrixXd& matrix :
       {Eigen::MatrixXd(vibration.angular_frequency), vibration.surface, vibration.beads, vibration.effective_mass}) {
    put(bytes, matrix);
  }
  put(bytes, Eigen::MatrixXd::Constant(1, 1, vibration.mass));
  return bytes + sha256_of(bytes);
}

/// @throws Error that says, as the second half of a sentence, why the file can't be used
GelVibration read_file(const std::filesystem::path& path, const std::string& key, int count) {
  const std::string content = read_whole_file(path);
  std::string_view bytes = content;
  if (bytes.size() < kMagic.size() + 2 * kDigestSize) fail("it ends early");
  if (!bytes.starts_with(kMagic)) fail("it isn't a gel's modes");
  const std::string_view sealed = bytes.substr(0, bytes.size() - kDigestSize);
  if (sha256_of(sealed) != bytes.substr(sealed.size())) fail("its checksum is wrong");
  bytes = sealed.substr(kMagic.size());
  if (!bytes.starts_with(key)) fail("it belongs to another gel");
  bytes.remove_prefix(kDigestSize);
  GelVibration vibration;
  const Eigen::MatrixXd frequency = take(bytes);
  vibration.surface = take(bytes);
  vibration.beads = take(bytes);
  vibration.effective_mass = take(bytes);
  const Eigen::MatrixXd mass = take(bytes);
  if (!bytes.empty() || frequency.cols() != 1 || frequency.rows() != count || vibration.surface.cols() != count ||
      vibration.beads.cols() != count || vibration.effective_mass.cols() != count || mass.size() != 1) {
    fail("its matrices don't fit each other");
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
                              const ElasticMaterial& material, std::span<const Bead> beads, double density, int count,
                              const std::filesystem::path& cache_dir) {
  const std::string key = key_of(gel_key, density, count);
  const std::filesystem::path path = vibration_file(cache_dir, gel_key, density, count);
  const bool keep = !cache_dir.empty();
  std::string note;
  std::error_code ignored;
  if (keep && std::filesystem::exists(path, ignored)) {
    try {
      return read_file(path, key, count);
    } catch (const Error& error) {
      note = fmt::format("the cached modes {} were made anew: {}", path.string(), error.what());
    }
  }
  GelVibration vibration = compute_vibration(mesh(), material, beads, density, count);
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
