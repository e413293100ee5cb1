#include "fem/compliance_cache.h"

#include <bit>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <system_error>
#include <type_traits>

#include "core/error.h"
#include "core/sha256.h"
#include "core/whole_file.h"

namespace touchstone::fem {
namespace {

// A file is: kMagic, the format's number (uint32), the key (64 hexadecimal digits), the body, and the SHA-256 of all
// before it (64 hexadecimal digits). The body is what write_body writes, little-endian.
static_assert(std::endian::native == std::endian::little);
constexpr std::string_view kMagic = "TSCOMPLY";
constexpr std::size_t kDigestSize = 64;
constexpr std::size_t kHeaderSize = kMagic.size() + sizeof(std::uint32_t) + kDigestSize;

struct Writer {
  std::string bytes;

  void raw(const void* data, std::size_t size) {
    if (size > 0) {
      bytes.append(static_cast<const char*>(data), size);
    }
  }
  template <typename T>
  void value(const T& item) {
    static_assert(std::is_arithmetic_v<T>);
    raw(&item, sizeof(T));
  }
  template <typename T>
  void array(const T* data, std::size_t count) {
    value(static_cast<std::uint64_t>(count));
    raw(data, count * sizeof(T));
  }
  void matrix(const Eigen::MatrixXd& matrix) {
    value(static_cast<std::int64_t>(matrix.rows()));
    value(static_cast<std::int64_t>(matrix.cols()));
    raw(matrix.data(), sizeof(double) * static_cast<std::size_t>(matrix.size()));
  }
};

/// Reads what Writer wrote. Throws Error where the bytes end early.
struct Reader {
  std::string_view bytes;

  void raw(void* data, std::size_t size) {
    if (size > bytes.size()) {
      fail("it ends early");
    }
    if (size > 0) {
      std::memcpy(data, bytes.data(), size);
    }
    bytes.remove_prefix(size);
  }
  template <typename T>
  T value() {
    T item;
    raw(&item, sizeof(T));
    return item;
  }
  /// A count of items of `size` bytes that are still to come.
  std::size_t count(std::size_t size) {
    const auto items = value<std::uint64_t>();
    if (items > bytes.size() / size) {
      fail("it ends early");
    }
    return items;
  }
  template <typename T>
  std::vector<T> array() {
    std::vector<T> items(count(sizeof(T)));
    raw(items.data(), items.size() * sizeof(T));
    return items;
  }
  Eigen::MatrixXd matrix(std::int64_t rows, std::int64_t columns) {
    if (value<std::int64_t>() != rows || value<std::int64_t>() != columns) {
      fail("its matrices don't fit its vertices");
    }
    Eigen::MatrixXd matrix(rows, columns);
    raw(matrix.data(), sizeof(double) * static_cast<std::size_t>(matrix.size()));
    return matrix;
  }
};

void write_body(const Compliance& gel, Writer& out) {
  out.value(gel.thickness);
  out.value(gel.material.youngs_modulus);
  out.value(gel.material.poisson_ratio);
  out.array(reinterpret_cast<const double*>(gel.vertices.data()), 3 * gel.vertices.size());
  out.array(reinterpret_cast<const std::int32_t*>(gel.triangles.data()), 3 * gel.triangles.size());
  TS_ASSERT(gel.mass.isCompressed());
  out.array(gel.mass.outerIndexPtr(), static_cast<std::size_t>(gel.mass.outerSize() + 1));
  out.array(gel.mass.innerIndexPtr(), static_cast<std::size_t>(gel.mass.nonZeros()));
  out.array(gel.mass.valuePtr(), static_cast<std::size_t>(gel.mass.nonZeros()));
  out.matrix(gel.surface);
  out.matrix(gel.beads);
  const ComplianceReport& report = gel.report;
  out.value(report.tetrahedra);
  out.value(report.unknowns);
  out.value(report.smallest_dihedral_deg);
  out.value(report.factor_entries);
  out.value(report.operations);
  out.value(report.memory_mb);
}

Compliance read_body(Reader& in, std::size_t bead_count) {
  Compliance gel;
  gel.thickness = in.value<double>();
  gel.material.youngs_modulus = in.value<double>();
  gel.material.poisson_ratio = in.value<double>();
  const auto coordinates = in.array<double>();
  for (std::size_t i = 0; i + 2 < coordinates.size(); i += 3) {
    gel.vertices.emplace_back(coordinates[i], coordinates[i + 1], coordinates[i + 2]);
  }
  const auto n = static_cast<std::int64_t>(gel.vertices.size());
  const auto corners = in.array<std::int32_t>();
  for (std::size_t i = 0; i + 2 < corners.size(); i += 3) {
    gel.triangles.push_back({corners[i], corners[i + 1], corners[i + 2]});
  }
  const auto columns = in.array<std::int32_t>();
  const auto rows = in.array<std::int32_t>();
  const auto values = in.array<double>();
  if (static_cast<std::int64_t>(columns.size()) != n + 1 || rows.size() != values.size() ||
      columns.back() != static_cast<std::int32_t>(rows.size())) {
    fail("its matrices don't fit its vertices");
  }
  gel.mass = Eigen::Map<const Eigen::SparseMatrix<double>>(n, n, static_cast<Eigen::Index>(rows.size()), columns.data(),
                                                           rows.data(), values.data());
  gel.surface = in.matrix(3 * n, 3 * n);
  gel.beads = in.matrix(3 * static_cast<std::int64_t>(bead_count), 3 * n);
  gel.report.tetrahedra = in.value<int>();
  gel.report.unknowns = in.value<int>();
  gel.report.smallest_dihedral_deg = in.value<double>();
  gel.report.factor_entries = in.value<double>();
  gel.report.operations = in.value<double>();
  gel.report.memory_mb = in.value<double>();
  if (!in.bytes.empty()) {
    fail("it is longer than it should be");
  }
  return gel;
}

/// @throws Error that says, as the second half of a sentence, why the file can't be used
Compliance read_file(const std::filesystem::path& path, const std::string& key, std::size_t bead_count) {
  const std::string content = read_whole_file(path);
  if (content.size() < kHeaderSize + kDigestSize) {
    fail("it ends early");
  }
  const std::string_view bytes = content;
  if (!bytes.starts_with(kMagic)) {
    fail("it isn't a compliance");
  }
  Reader in{bytes.substr(kMagic.size())};
  const auto format = in.value<std::uint32_t>();
  if (format != kComplianceFormat) {
    fail("it has format {}, this program writes {}", format, kComplianceFormat);
  }
  const std::string_view sealed = bytes.substr(0, bytes.size() - kDigestSize);
  if (sha256_of(sealed) != bytes.substr(sealed.size())) {
    fail("its checksum is wrong");
  }
  if (bytes.substr(kHeaderSize - kDigestSize, kDigestSize) != key) {
    fail("it belongs to another gel");
  }
  in.bytes = sealed.substr(kHeaderSize);
  return read_body(in, bead_count);
}

void write_file(const std::filesystem::path& path, const std::string& key, const Compliance& gel) {
  Writer out;
  out.bytes = kMagic;
  out.value(static_cast<std::uint32_t>(kComplianceFormat));
  out.bytes += key;
  write_body(gel, out);
  out.bytes += sha256_of(out.bytes);
  write_whole_file(path, out.bytes);
}

}  // namespace

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

std::filesystem::path compliance_file(const std::filesystem::path& cache_dir, const std::string& key) {
  return cache_dir / ("compliance-" + key + ".bin");
}

Compliance cached_compliance(const SlabMesh& slab, const ElasticMaterial& material, std::span<const Bead> beads,
                             const std::filesystem::path& cache_dir, const Progress& progress) {
  return cached_compliance(SlabGel{slab, {}}, std::span(&material, 1), beads, cache_dir, progress);
}

Compliance cached_compliance(const GelBody& body, std::span<const ElasticMaterial> materials,
                             std::span<const Bead> beads, const std::filesystem::path& cache_dir,
                             const Progress& progress) {
  check(body);
  for (const ElasticMaterial& material : materials) check(material);
  if (static_cast<int>(materials.size()) != material_count(body)) {
    fail("the gel takes {} materials, but {} are given", material_count(body), materials.size());
  }
  const std::string key = compliance_key(body, materials, beads);
  const std::filesystem::path path = compliance_file(cache_dir, key);
  const bool keep = !cache_dir.empty();
  std::string note;
  std::error_code ignored;
  if (keep && std::filesystem::exists(path, ignored)) {
    try {
      return read_file(path, key, beads.size());
    } catch (const Error& error) {
      note = fmt::format("the cached compliance {} was made anew: {}", path.string(), error.what());
    }
  }
  Compliance gel = compute_compliance(mesh_gel(body), materials, beads, thickness_of(body), progress);
  if (keep) {
    try {
      std::filesystem::create_directories(cache_dir, ignored);
      write_file(path, key, gel);
    } catch (const std::exception& error) {
      note += fmt::format("{}the compliance couldn't be kept: {}", note.empty() ? "" : "; ", error.what());
    }
  }
  gel.report.note = note;
  return gel;
}

}  // namespace touchstone::fem
