#include "fem/elements/front.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cstddef>
#include <vector>

extern "C" {
void dpotrf_(const char* half, const int* size, double* matrix, const int* stride, int* info, std::size_t);
void spotrf_(const char* half, const int* size, float* matrix, const int* stride, int* info, std::size_t);
void dtrsm_(const char* side, const char* half, const char* transposed, const char* unit, const int* rows,
            const int* columns, const double* scale, const double* triangle, const int* triangle_stride, double* right,
            const int* stride, std::size_t, std::size_t, std::size_t, std::size_t);
void strsm_(const char* side, const char* half, const char* transposed, const char* unit, const int* rows,
            const int* columns, const float* scale, const float* triangle, const int* triangle_stride, float* right,
            const int* stride, std::size_t, std::size_t, std::size_t, std::size_t);
void dgemm_(const char* transposed_a, const char* transposed_b, const int* rows, const int* columns, const int* inner,
            const double* scale, const double* a, const int* a_stride, const double* b, const int* b_stride,
            const double* keep, double* c, const int* c_stride, std::size_t, std::size_t);
void sgemm_(const char* transposed_a, const char* transposed_b, const int* rows, const int* columns, const int* inner,
            const float* scale, const float* a, const int* a_stride, const float* b, const int* b_stride,
            const float* keep, float* c, const int* c_stride, std::size_t, std::size_t);
void dsyrk_(const char* half, const char* transposed, const int* size, const int* inner, const double* scale,
            const double* a, const int* a_stride, const double* keep, double* c, const int* c_stride, std::size_t,
            std::size_t);
void ssyrk_(const char* half, const char* transposed, const int* size, const int* inner, const float* scale,
            const float* a, const int* a_stride, const float* keep, float* c, const int* c_stride, std::size_t,
            std::size_t);
void sgetrf_(const int* rows, const int* columns, float* matrix, const int* stride, int* pivots, int* info);
void sgetri_(const int* size, float* matrix, const int* stride, const int* pivots, float* work, const int* length,
             int* info);
}

namespace touchstone::fem {
namespace {

/// Pivots that are eliminated at once.
constexpr int kPanel = 192;
/// Rows and columns of a tile.
constexpr int kTile = 384;

/// The routines of either precision.
template <typename Real>
struct Blas;
template <>
struct Blas<double> {
  static constexpr auto potrf = dpotrf_;
  static constexpr auto trsm = dtrsm_;
  static constexpr auto gemm = dgemm_;
  static constexpr auto syrk = dsyrk_;
};
template <>
struct Blas<float> {
  static constexpr auto potrf = spotrf_;
  static constexpr auto trsm = strsm_;
  static constexpr auto gemm = sgemm_;
  static constexpr auto syrk = ssyrk_;
};

template <typename Work>
void each(int count, const Work& work) {
  if (count <= 1) {
    for (int k = 0; k < count; ++k) work(k);
    return;
  }
  // Isolated: a thread that waits here must not begin another branch of the tree, whose memory comes on top.
  tbb::this_task_arena::isolate([&] { tbb::parallel_for(0, count, work); });
}

/// A front, and which of its pivots have been eliminated.
template <typename Real>
class Front {
 public:
  Front(Real* data, int size) : data_(data), size_(size) {}

  /// Eliminates pivots from..to, all of one sign. Only columns below `columns` are brought up to date.
  bool eliminate(int from, int to, Real sign, int columns) {
    const int width = to - from;
    Real* corner = at(from, from);
    if (sign < 0) {
      for (int j = 0; j < width; ++j) {
        for (int i = j; i < width; ++i) corner[i + static_cast<std::ptrdiff_t>(j) * size_] *= Real(-1);
      }
    }
    int info = 0;
    Blas<Real>::potrf("L", &width, corner, &size_, &info, 1);
    if (info != 0) return false;
    each((size_ - to + kTile - 1) / kTile, [&](int tile) {
      const int row = to + tile * kTile;
      const int rows = std::min(kTile, size_ - row);
      // With the sign here, rows and corner are L of L D L^T; the update below, their square, doesn't see it.
      Blas<Real>::trsm("R", "L", "T", "N", &rows, &width, &sign, corner, &size_, at(row, from), &size_, 1, 1, 1, 1);
    });
    update(from, to, sign, to, columns);
    return true;
  }

  /// Takes the pivots from..to, which are eliminated, out of the columns first..last and the rows below.
  void update(int from, int to, Real sign, int first, int last) {
    if (from == to || first >= last) return;
    const int inner = to - from;
    const Real scale = -sign;
    const Real keep = 1;
    const int tile_columns = (last - first + kTile - 1) / kTile;
    const int tile_rows = (size_ - first + kTile - 1) / kTile;
    each(tile_columns * tile_rows, [&](int tile) {
      const int row_tile = tile / tile_columns;
      const int column_tile = tile % tile_columns;
      if (row_tile < column_tile) return;
      const int row = first + row_tile * kTile;
      const int column = first + column_tile * kTile;
      const int rows = std::min(kTile, size_ - row);
      const int columns = std::min(kTile, last - column);
      if (row_tile == column_tile) {
        Blas<Real>::syrk("L", "N", &columns, &inner, &scale, at(column, from), &size_, &keep, at(column, column),
                         &size_, 1, 1);
        const int below = rows - columns;  // where the columns end before the tile does
        if (below > 0) multiply(column + columns, column, below, columns, from, inner, scale);
        return;
      }
      multiply(row, column, rows, columns, from, inner, scale);
    });
  }

 private:
  Real* at(int row, int column) { return data_ + row + static_cast<std::ptrdiff_t>(column) * size_; }

  void multiply(int row, int column, int rows, int columns, int from, int inner, Real scale) {
    const Real keep = 1;
    Blas<Real>::gemm("N", "T", &rows, &columns, &inner, &scale, at(row, from), &size_, at(column, from), &size_, &keep,
                     at(row, column), &size_, 1, 1);
  }

  Real* data_;
  int size_;
};

template <typename Real>
bool eliminate(Real* data, int size, int positive, int negative) {
  Front<Real> front(data, size);
  const int pivots = positive + negative;
  // Within the pivots' columns panel by panel; the rest takes them all at once.
  for (int from = 0; from < pivots;) {
    const bool first = from < positive;
    const int to = std::min(from + kPanel, first ? positive : pivots);
    if (!front.eliminate(from, to, first ? Real(1) : Real(-1), pivots)) return false;
    from = to;
  }
  front.update(0, positive, Real(1), pivots, size);
  front.update(positive, pivots, Real(-1), pivots, size);
  return true;
}

}  // namespace

bool eliminate_front(double* front, int size, int positive, int negative) {
  return eliminate(front, size, positive, negative);
}

bool eliminate_front(float* front, int size, int positive, int negative) {
  return eliminate(front, size, positive, negative);
}

bool eliminate_indefinite_front(float* data, int size, int pivots) {
  const auto at = [&](std::ptrdiff_t row, std::ptrdiff_t column) { return data + row + column * size; };
  for (std::ptrdiff_t j = 0; j < pivots; ++j) {
    for (std::ptrdiff_t i = j + 1; i < pivots; ++i) *at(j, i) = *at(i, j);
  }
  std::vector<int> swaps(static_cast<std::size_t>(pivots));
  int info = 0;
  sgetrf_(&pivots, &pivots, data, &size, swaps.data(), &info);
  if (info != 0) return false;
  const int length = pivots * kPanel;
  std::vector<float> work(static_cast<std::size_t>(length));
  sgetri_(&pivots, data, &size, swaps.data(), work.data(), &length, &info);
  if (info != 0) return false;
  const int later = size - pivots;
  if (later == 0) return true;
  // The rows times the inverse, then out of what is left; both need the rows as they were.
  const std::vector<float> rows = [&] {
    std::vector<float> copy(static_cast<std::size_t>(later) * static_cast<std::size_t>(pivots));
    for (std::ptrdiff_t j = 0; j < pivots; ++j) std::copy_n(at(pivots, j), later, copy.data() + j * later);
    return copy;
  }();
  const float one = 1.0f;
  const float minus = -1.0f;
  const float none = 0.0f;
  const int tiles = (later + kTile - 1) / kTile;
  each(tiles, [&](int tile) {
    const int row = tile * kTile;
    const int count = std::min(kTile, later - row);
    sgemm_("N", "N", &count, &pivots, &pivots, &one, rows.data() + row, &later, data, &size, &none, at(pivots + row, 0),
           &size, 1, 1);
  });
  each(tiles * tiles, [&](int tile) {
    const int row = tile / tiles * kTile;
    const int column = tile % tiles * kTile;
    if (row < column) return;
    const int count = std::min(kTile, later - row);
    const int columns = std::min(kTile, later - column);
    sgemm_("N", "T", &count, &columns, &pivots, &minus, at(pivots + row, 0), &size, rows.data() + column, &later, &one,
           at(pivots + row, pivots + column), &size, 1, 1);
  });
  return true;
}

}  // namespace touchstone::fem
