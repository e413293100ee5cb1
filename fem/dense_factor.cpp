#include "fem/dense_factor.h"

#include <utility>

#include "core/error.h"

extern "C" {
void openblas_set_num_threads(int count);
int openblas_get_num_threads(void);
void dgetrf_(const int* rows, const int* columns, double* matrix, const int* stride, int* pivots, int* info);
void dgetrs_(const char* transposed, const int* size, const int* rights, const double* matrix, const int* stride,
             const int* pivots, double* right, const int* right_stride, int* info, std::size_t);
void dpotrf_(const char* half, const int* size, double* matrix, const int* stride, int* info, std::size_t);
void dpotrs_(const char* half, const int* size, const int* rights, const double* matrix, const int* stride,
             double* right, const int* right_stride, int* info, std::size_t);
}

namespace touchstone::fem {
namespace {

/// The result must not depend on how many cores there are, nor on who set what before.
void one_thread() {
  if (openblas_get_num_threads() != 1) openblas_set_num_threads(1);
}

}  // namespace

bool DenseLu::compute(Eigen::MatrixXd matrix) {
  TS_ASSERT(matrix.rows() == matrix.cols());
  one_thread();
  factor_ = std::move(matrix);
  const int size = static_cast<int>(factor_.rows());
  pivots_.resize(size);
  int info = 0;
  if (size > 0) dgetrf_(&size, &size, factor_.data(), &size, pivots_.data(), &info);
  return info == 0;
}

Eigen::VectorXd DenseLu::solve(const Eigen::VectorXd& right) const {
  const int size = static_cast<int>(factor_.rows());
  TS_ASSERT(right.size() == size);
  Eigen::VectorXd result = right;
  const int one = 1;
  int info = 0;
  if (size > 0) dgetrs_("N", &size, &one, factor_.data(), &size, pivots_.data(), result.data(), &size, &info, 1);
  return result;
}

bool DenseCholesky::compute(Eigen::MatrixXd matrix) {
  TS_ASSERT(matrix.rows() == matrix.cols());
  one_thread();
  factor_ = std::move(matrix);
  const int size = static_cast<int>(factor_.rows());
  int info = 0;
  if (size > 0) dpotrf_("L", &size, factor_.data(), &size, &info, 1);
  return info == 0;
}

Eigen::MatrixXd DenseCholesky::solve(Eigen::MatrixXd right) const {
  const int size = static_cast<int>(factor_.rows());
  TS_ASSERT(right.rows() == size);
  const int rights = static_cast<int>(right.cols());
  int info = 0;
  if (size > 0 && rights > 0) dpotrs_("L", &size, &rights, factor_.data(), &size, right.data(), &size, &info, 1);
  return right;
}

}  // namespace touchstone::fem
