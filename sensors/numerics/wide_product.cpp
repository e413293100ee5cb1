#include "sensors/numerics/wide_product.h"

#include <algorithm>
#include <cstring>
#include <vector>

#include "core/error.h"

namespace touchstone::sensors {
namespace {

constexpr Eigen::Index kDepth = 256;  // of the inner index, a block
constexpr Eigen::Index kRows = 240;   // of a, a block: a multiple of every form's rows, 480 kB
constexpr Eigen::Index kMostTile = 24 * 8;

/// One tile of a b^T: `depth` columns of a packed `kWidth * kVectors` at a time, of b `kColumns` at a time. Each entry
/// is summed from the first to the last.
template <int kWidth, int kVectors, int kColumns>
[[gnu::always_inline]] inline void sum_tile(Eigen::Index depth, const double* a, const double* b, double* tile) {
  typedef double Vector __attribute__((vector_size(kWidth * sizeof(double))));
  Vector sum[kColumns][kVectors] = {};
  for (Eigen::Index p = 0; p < depth; ++p) {
    Vector left[kVectors];
    for (int i = 0; i < kVectors; ++i) std::memcpy(&left[i], a + (p * kVectors + i) * kWidth, sizeof(Vector));
    for (int j = 0; j < kColumns; ++j) {
      const double right = b[p * kColumns + j];
      for (int i = 0; i < kVectors; ++i) sum[j][i] += left[i] * right;
    }
  }
  for (int j = 0; j < kColumns; ++j) {
    for (int i = 0; i < kVectors; ++i) std::memcpy(tile + (j * kVectors + i) * kWidth, &sum[j][i], sizeof(Vector));
  }
}

struct TileForm {
  Eigen::Index rows, columns;
  void (*sum)(Eigen::Index, const double*, const double*, double*);
};

void sum_plain(Eigen::Index depth, const double* a, const double* b, double* tile) {
  sum_tile<2, 2, 4>(depth, a, b, tile);
}

#if defined(__x86_64__) && defined(__GNUC__)
[[gnu::target("avx2")]] void sum_avx2(Eigen::Index depth, const double* a, const double* b, double* tile) {
  sum_tile<4, 2, 4>(depth, a, b, tile);
}
[[gnu::target("avx512f")]] void sum_avx512(Eigen::Index depth, const double* a, const double* b, double* tile) {
  sum_tile<8, 3, 8>(depth, a, b, tile);
}
TileForm tile_form() {
  if (__builtin_cpu_supports("avx512f")) return {24, 8, sum_avx512};
  if (__builtin_cpu_supports("avx2")) return {8, 4, sum_avx2};
  return {4, 4, sum_plain};
}
#else
TileForm tile_form() {
  return {4, 4, sum_plain};
}
#endif

/// Rows [begin, begin + rows) and columns [first, first + depth) in slices of `slice` rows, each column of a slice in a
/// piece, padded with zeros.
void pack(const Eigen::Ref<const Eigen::MatrixXd>& matrix, Eigen::Index begin, Eigen::Index rows, Eigen::Index first,
          Eigen::Index depth, Eigen::Index slice, double* out) {
  for (Eigen::Index top = 0; top < rows; top += slice) {
    const Eigen::Index height = std::min(slice, rows - top);
    for (Eigen::Index p = 0; p < depth; ++p) {
      const double* column = matrix.data() + (first + p) * matrix.outerStride() + begin + top;
      std::copy_n(column, height, out);
      std::fill_n(out + height, slice - height, 0.0);
      out += slice;
    }
  }
}

}  // namespace

void subtract_product(Eigen::Ref<Eigen::MatrixXd> c, const Eigen::Ref<const Eigen::MatrixXd>& a,
                      const Eigen::Ref<const Eigen::MatrixXd>& b, ProductPart part) {
  TS_ASSERT(c.rows() == a.rows() && c.cols() == b.rows() && a.cols() == b.cols());
  TS_ASSERT(part == ProductPart::kAll || c.rows() == c.cols());
  static const TileForm kForm = tile_form();
  constexpr Eigen::Index kColumns = 192;  // of c, a block: a multiple of every form's columns
  const Eigen::Index deepest = std::min(kDepth, a.cols());
  std::vector<double> left(static_cast<std::size_t>(std::min(kRows, c.rows() + kForm.rows) * deepest));
  std::vector<double> right(static_cast<std::size_t>(std::min(kColumns, c.cols() + kForm.columns) * deepest));
  double tile[kMostTile];
  for (Eigen::Index first = 0; first < a.cols(); first += kDepth) {
    const Eigen::Index depth = std::min(kDepth, a.cols() - first);
    for (Eigen::Index j0 = 0; j0 < c.cols(); j0 += kColumns) {
      const Eigen::Index columns = std::min(kColumns, c.cols() - j0);
      pack(b, j0, columns, first, depth, kForm.columns, right.data());
      for (Eigen::Index i0 = part == ProductPart::kLower ? j0 : 0; i0 < c.rows(); i0 += kRows) {
        const Eigen::Index rows = std::min(kRows, c.rows() - i0);
        pack(a, i0, rows, first, depth, kForm.rows, left.data());
        for (Eigen::Index j = 0; j < columns; j += kForm.columns) {
          for (Eigen::Index i = 0; i < rows; i += kForm.rows) {
            if (part == ProductPart::kLower && i0 + i + kForm.rows <= j0 + j) continue;
            kForm.sum(depth, left.data() + i * depth, right.data() + j * depth, tile);
            const Eigen::Index height = std::min(kForm.rows, rows - i);
            const Eigen::Index width = std::min(kForm.columns, columns - j);
            for (Eigen::Index q = 0; q < width; ++q) {
              double* out = &c.coeffRef(i0 + i, j0 + j + q);
              for (Eigen::Index r = 0; r < height; ++r) out[r] -= tile[q * kForm.rows + r];
            }
          }
        }
      }
    }
  }
}

}  // namespace touchstone::sensors
