#include "fem/elements/row_skeleton.h"

#include <algorithm>
#include <cstddef>
#include <numeric>

#include "core/error.h"

extern "C" {
void openblas_set_num_threads(int);
int openblas_get_num_threads(void);
void dsyrk_(const char* half, const char* transposed, const int* size, const int* inner, const double* scale,
            const double* a, const int* a_stride, const double* keep, double* c, const int* c_stride, std::size_t,
            std::size_t);
void dpstrf_(const char* half, const int* size, double* matrix, const int* stride, int* pivots, int* rank,
             const double* tolerance, double* work, int* info, std::size_t);
void dtrsm_(const char* side, const char* half, const char* transposed, const char* unit, const int* rows,
            const int* columns, const double* scale, const double* triangle, const int* triangle_stride, double* right,
            const int* stride, std::size_t, std::size_t, std::size_t, std::size_t);
}

namespace touchstone::fem {

RowSkeleton row_skeleton(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& scale, double tolerance) {
  const int rows = static_cast<int>(matrix.rows());
  const int columns = static_cast<int>(matrix.cols());
  TS_ASSERT(scale.size() == columns);
  RowSkeleton result;
  const auto none = [&] {
    result.others.resize(static_cast<std::size_t>(rows));
    std::iota(result.others.begin(), result.others.end(), 0);
    result.from.resize(rows, 0);
    return result;
  };
  if (rows == 0 || columns == 0) return none();
  if (openblas_get_num_threads() != 1) openblas_set_num_threads(1);
  const Eigen::MatrixXd scaled = matrix * scale.cwiseInverse().asDiagonal();
  Eigen::MatrixXd products = Eigen::MatrixXd::Zero(rows, rows);
  const double one = 1.0;
  const double zero = 0.0;
  dsyrk_("L", "N", &rows, &columns, &one, scaled.data(), &rows, &zero, products.data(), &rows, 1, 1);
  const double largest = products.diagonal().maxCoeff();
  if (!(largest > 0.0)) return none();
  // What is left of each row; dpstrf stops where the largest of them is below.
  const double left = std::max(tolerance * tolerance / rows, 1e-15 * rows * largest);
  std::vector<int> pivots(static_cast<std::size_t>(rows));
  std::vector<double> work(static_cast<std::size_t>(2 * rows));
  int rank = 0;
  int info = 0;
  dpstrf_("L", &rows, products.data(), &rows, pivots.data(), &rank, &left, work.data(), &info, 1);
  TS_ASSERT(info >= 0);
  const int others = rows - rank;
  if (others > 0 && rank > 0) {
    dtrsm_("R", "L", "N", "N", &others, &rank, &one, products.data(), &rows, products.data() + rank, &rows, 1, 1, 1, 1);
  }
  // In the rows' own order, so that neighbours stay together.
  std::vector<int> place(static_cast<std::size_t>(rows));
  std::iota(place.begin(), place.end(), 0);
  const auto by_row = [&](int a, int b) { return pivots[a] < pivots[b]; };
  std::sort(place.begin(), place.begin() + rank, by_row);
  std::sort(place.begin() + rank, place.end(), by_row);
  result.from.resize(others, rank);
  for (int i = 0; i < others; ++i) {
    result.others.push_back(pivots[place[rank + i]] - 1);
    for (int k = 0; k < rank; ++k) result.from(i, k) = products(place[rank + i], place[k]);
  }
  for (int k = 0; k < rank; ++k) result.kept.push_back(pivots[place[k]] - 1);
  return result;
}

}  // namespace touchstone::fem
