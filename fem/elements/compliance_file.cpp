#include "fem/elements/compliance_file.h"

#include <xxhash.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/mapped_file.h"
#include "core/whole_file.h"

namespace touchstone::fem {
namespace {

static_assert(std::endian::native == std::endian::little);
constexpr std::string_view kMagic = "TSCOMPLY";
constexpr std::uint64_t kPage = 4096;

struct MatrixPlace {
  std::uint64_t offset = 0;
  std::uint64_t rows = 0;
  std::uint64_t columns = 0;
};

/// The first bytes of a file, as they lie there.
struct Header {
  std::array<char, 8> magic{};
  std::uint32_t format = kComplianceFormat;
  std::uint32_t zero = 0;
  std::array<char, 64> key{};
  std::uint64_t file_size = 0;
  std::uint64_t body_offset = sizeof(Header);
  std::uint64_t body_size = 0;
  MatrixPlace surface;
  MatrixPlace beads;
  XXH128_canonical_t checksum{};
};
static_assert(std::is_trivially_copyable_v<Header> && offsetof(Header, checksum) == 152 && sizeof(Header) == 168);

std::uint64_t next_page(std::uint64_t offset) {
  return (offset + kPage - 1) / kPage * kPage;
}

/// XXH3 over pieces.
class Checksum {
 public:
  Checksum() : state_(XXH3_createState(), XXH3_freeState) {
    TS_ASSERT(state_ != nullptr && XXH3_128bits_reset(state_.get()) == XXH_OK);
  }
  void add(const void* bytes, std::size_t size) {
    if (size > 0) TS_ASSERT(XXH3_128bits_update(state_.get(), bytes, size) == XXH_OK);
  }
  XXH128_canonical_t digest() const {
    XXH128_canonical_t result;
    XXH128_canonicalFromHash(&result, XXH3_128bits_digest(state_.get()));
    return result;
  }

 private:
  std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)> state_;
};

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
};

void write_errors(const BodyErrors& body, Writer& out) {
  out.array(body.radius_per_edge.data(), body.radius_per_edge.size());
  for (const RelativeErrors& errors : body.errors) out.raw(errors.values.data(), sizeof(errors.values));
  out.raw(body.mesh_order.values.data(), sizeof(body.mesh_order.values));
  out.raw(body.size_order.values.data(), sizeof(body.size_order.values));
}

BodyErrors read_errors(Reader& in) {
  BodyErrors body;
  body.radius_per_edge = in.array<double>();
  body.errors.resize(body.radius_per_edge.size());
  for (RelativeErrors& errors : body.errors) in.raw(errors.values.data(), sizeof(errors.values));
  in.raw(body.mesh_order.values.data(), sizeof(body.mesh_order.values));
  in.raw(body.size_order.values.data(), sizeof(body.size_order.values));
  return body;
}

/// How the numbers of a compressed compliance belong together.
void write_layout(const FarFieldMatrix& matrix, const ComplianceReport& report, Writer& out) {
  const FarFieldMatrix::Parts& parts = matrix.parts();
  out.value(report.compression_error);
  out.value(matrix.factor());
  out.array(parts.order.data(), parts.order.size());
  out.value(static_cast<std::uint64_t>(parts.clusters.size()));
  for (const FarFieldMatrix::Cluster& c : parts.clusters) {
    for (const int number : {c.parent, c.halves[0], c.halves[1], c.first, c.last, c.rank}) out.value(number);
    out.value(static_cast<std::uint64_t>(c.basis));
  }
  out.value(static_cast<std::uint64_t>(parts.blocks.size()));
  for (const FarFieldMatrix::Block& b : parts.blocks) {
    for (const int number : {b.row, b.column, static_cast<int>(b.far)}) out.value(number);
    out.value(static_cast<std::uint64_t>(b.numbers));
  }
}

FarFieldMatrix::Parts read_layout(Reader& in) {
  FarFieldMatrix::Parts parts;
  parts.order = in.array<int>();
  parts.clusters.resize(in.count(6 * sizeof(int) + sizeof(std::uint64_t)));
  for (FarFieldMatrix::Cluster& c : parts.clusters) {
    for (int* const number : {&c.parent, &c.halves[0], &c.halves[1], &c.first, &c.last, &c.rank}) {
      *number = in.value<int>();
    }
    c.basis = in.value<std::uint64_t>();
  }
  parts.blocks.resize(in.count(3 * sizeof(int) + sizeof(std::uint64_t)));
  for (FarFieldMatrix::Block& b : parts.blocks) {
    b.row = in.value<int>();
    b.column = in.value<int>();
    b.far = in.value<int>() != 0;
    b.numbers = in.value<std::uint64_t>();
  }
  return parts;
}

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
  const ComplianceReport& report = gel.report;
  out.value(report.tetrahedra);
  out.value(report.unknowns);
  out.value(report.smallest_dihedral_deg);
  out.value(report.fine_edge);
  out.value(report.factor_entries);
  out.value(report.operations);
  out.value(report.memory_mb);
  write_errors(gel.mesh_error.smooth, out);
  write_errors(gel.mesh_error.sharp, out);
  if (const FarFieldMatrix* const compressed = gel.surface.compressed()) write_layout(*compressed, report, out);
}

/// `far`: the layout of a compressed compliance is there, too, and goes there, with its factor.
Compliance read_body(Reader& in, std::optional<std::pair<FarFieldMatrix::Parts, double>>& far) {
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
  const auto within = [](const std::vector<std::int32_t>& numbers, std::int64_t most) {
    return std::all_of(numbers.begin(), numbers.end(), [&](std::int64_t i) { return i >= 0 && i < most; });
  };
  const auto finite = [](std::span<const double> numbers) {
    return std::all_of(numbers.begin(), numbers.end(), [](double number) { return std::isfinite(number); });
  };
  if (!(gel.thickness > 0.0) || !(gel.material.youngs_modulus > 0.0) || !std::isfinite(gel.thickness) ||
      !std::isfinite(gel.material.youngs_modulus) || !std::isfinite(gel.material.poisson_ratio) ||
      !finite(coordinates) || !finite(values)) {
    fail("it has numbers that aren't a gel's");
  }
  if (coordinates.size() % 3 != 0 || corners.size() % 3 != 0 || static_cast<std::int64_t>(columns.size()) != n + 1 ||
      rows.size() != values.size() || columns.front() != 0 ||
      columns.back() != static_cast<std::int32_t>(rows.size()) || !std::is_sorted(columns.begin(), columns.end()) ||
      !within(rows, n) || !within(corners, n)) {
    fail("its matrices don't fit its vertices");
  }
  for (std::size_t k = 0; k + 1 < columns.size(); ++k) {  // each row once a column, in order, as Eigen needs them
    if (std::adjacent_find(rows.begin() + columns[k], rows.begin() + columns[k + 1], std::greater_equal<>()) !=
        rows.begin() + columns[k + 1]) {
      fail("its matrices don't fit its vertices");
    }
  }
  gel.mass = Eigen::Map<const Eigen::SparseMatrix<double>>(n, n, static_cast<Eigen::Index>(rows.size()), columns.data(),
                                                           rows.data(), values.data());
  gel.report.tetrahedra = in.value<int>();
  gel.report.unknowns = in.value<int>();
  gel.report.smallest_dihedral_deg = in.value<double>();
  gel.report.fine_edge = in.value<double>();
  gel.report.factor_entries = in.value<double>();
  gel.report.operations = in.value<double>();
  gel.report.memory_mb = in.value<double>();
  gel.mesh_error.smooth = read_errors(in);
  gel.mesh_error.sharp = read_errors(in);
  if (far) {
    gel.report.compression_error = in.value<double>();
    far->second = in.value<double>();
    far->first = read_layout(in);
  }
  if (!in.bytes.empty()) {
    fail("it is longer than it should be");
  }
  return gel;
}

/// A matrix in the mapped file, checked to lie within it.
SharedMatrix matrix_at(const MappedFile& file, const MatrixPlace& place, std::uint64_t rows, std::uint64_t columns) {
  if (place.rows != rows || place.columns != columns) fail("its matrices don't fit its vertices");
  if (rows > file.size || columns > file.size) fail("it ends early");  // no product below overflows
  const std::uint64_t bytes = sizeof(double) * rows * columns;
  if (place.offset % kPage != 0 || place.offset > file.size || bytes > file.size - place.offset) {
    fail("it ends early");
  }
  const auto* numbers = reinterpret_cast<const double*>(file.bytes.get() + place.offset);
  return {std::shared_ptr<const double>(file.bytes, numbers), static_cast<Eigen::Index>(rows),
          static_cast<Eigen::Index>(columns)};
}

std::uint64_t bytes_of(const SharedMatrix& matrix) {
  return sizeof(double) * static_cast<std::uint64_t>(matrix.size());
}

}  // namespace

void write_compliance(const std::filesystem::path& path, const std::string& key, const Compliance& gel) {
  Writer body;
  write_body(gel, body);
  Header header;
  std::copy(kMagic.begin(), kMagic.end(), header.magic.begin());
  TS_ASSERT(key.size() == header.key.size());
  std::copy(key.begin(), key.end(), header.key.begin());
  header.body_size = body.bytes.size();
  const auto place = [](const SharedMatrix& matrix, std::uint64_t offset) {
    return MatrixPlace{offset, static_cast<std::uint64_t>(matrix.rows()), static_cast<std::uint64_t>(matrix.cols())};
  };
  const FarFieldMatrix* const compressed = gel.surface.compressed();
  const SharedMatrix& surface = compressed != nullptr ? compressed->parts().numbers : *gel.surface.whole();
  header.surface = place(surface, next_page(header.body_offset + header.body_size));
  header.beads = place(gel.beads, next_page(header.surface.offset + bytes_of(surface)));
  header.file_size = header.beads.offset + bytes_of(gel.beads);

  const std::string zeros(kPage, '\0');
  std::vector<std::string_view> pieces;
  std::uint64_t end = header.body_offset;
  const auto put = [&](std::uint64_t offset, const void* bytes, std::uint64_t size) {
    pieces.emplace_back(zeros.data(), offset - end);
    pieces.emplace_back(static_cast<const char*>(bytes), size);
    end = offset + size;
  };
  put(header.body_offset, body.bytes.data(), body.bytes.size());
  put(header.surface.offset, surface.view().data(), bytes_of(surface));
  put(header.beads.offset, gel.beads.view().data(), bytes_of(gel.beads));

  Checksum sum;
  sum.add(&header, offsetof(Header, checksum));
  for (const std::string_view piece : pieces) sum.add(piece.data(), piece.size());
  header.checksum = sum.digest();
  write_whole_file(path, [&](const std::filesystem::path& temporary) {
    std::ofstream out(temporary, std::ios::binary);
    out.write(reinterpret_cast<const char*>(&header), sizeof(header));
    for (const std::string_view piece : pieces) out.write(piece.data(), static_cast<std::streamsize>(piece.size()));
    out.close();
    if (!out) fail("{}: can't be written", path.string());
  });
}

Compliance read_compliance(const std::filesystem::path& path, const std::string& key) {
  const MappedFile file = map_file(path);
  const std::string_view bytes(file.bytes.get(), file.size);
  if (!bytes.starts_with(kMagic)) fail("it isn't a compliance");
  if (bytes.size() < sizeof(Header)) fail("it ends early");
  Header header;
  std::memcpy(&header, bytes.data(), sizeof(header));
  if (header.format != kComplianceFormat) {
    fail("it has format {}, this program writes {}", header.format, kComplianceFormat);
  }
  if (bytes.size() < header.file_size) fail("it ends early");
  if (bytes.size() > header.file_size) fail("it is longer than it should be");
  Checksum sum;
  sum.add(bytes.data(), offsetof(Header, checksum));
  sum.add(bytes.data() + sizeof(header), bytes.size() - sizeof(header));
  if (const XXH128_canonical_t found = sum.digest(); std::memcmp(&found, &header.checksum, sizeof(found)) != 0) {
    fail("its checksum is wrong");
  }
  if (std::string_view(header.key.data(), header.key.size()) != key) fail("it belongs to another gel");
  if (header.body_offset > bytes.size() || header.body_size > bytes.size() - header.body_offset) {
    fail("it ends early");
  }
  Reader body{bytes.substr(header.body_offset, header.body_size)};
  // A surface matrix of one column is the numbers of a compressed one.
  std::optional<std::pair<FarFieldMatrix::Parts, double>> far;
  if (header.surface.columns == 1) far.emplace();
  Compliance gel = read_body(body, far);
  const std::uint64_t unknowns = 3 * gel.vertices.size();
  if (far) {
    far->first.numbers = matrix_at(file, header.surface, header.surface.rows, 1);
    if (far->first.order.size() != gel.vertices.size()) fail("its matrices don't fit its vertices");
    gel.surface = FarFieldMatrix(std::move(far->first), far->second);
  } else {
    gel.surface = matrix_at(file, header.surface, unknowns, unknowns);
  }
  gel.beads = matrix_at(file, header.beads, header.beads.rows, unknowns);
  if (header.beads.rows % 3 != 0) fail("its matrices don't fit its vertices");
  const SharedMatrix* const whole = gel.surface.whole();
  if (!(whole != nullptr ? *whole : gel.surface.compressed()->parts().numbers).view().allFinite() ||
      !gel.beads.view().allFinite() || (far && !std::isfinite(far->second))) {
    fail("it has numbers that aren't a gel's");
  }
  return gel;
}

double compliance_file_bytes(int surface_vertices, int beads) {
  const double n = surface_vertices;
  // Some 7 entries of the mass matrix and 2 triangles a vertex.
  const double others = 72.0 * n * beads + 160.0 * n;
  if (is_kept_whole(surface_vertices, beads)) return 72.0 * n * n + others;
  // Of slabs of 1,900 and 6,600 vertices with fine edges all over; it grows as n log n.
  return n * (9.8e3 * std::log(n) - 50e3) + others;
}

}  // namespace touchstone::fem
