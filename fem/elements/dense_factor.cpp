#include "fem/elements/dense_factor.h"

#include <cmath>
#include <utility>

#include "core/error.h"

extern "C" {
void openblas_set_num_threads(int count);
int openblas_get_num_threads(void);
void sgetrf_(const int* rows, const int* columns, float* matrix, const int* stride, int* pivots, int* info);
void sgetrs_(const char* transposed, const int* size, const int* rights, const float* matrix, const int* stride,
             const int* pivots, float* right, const int* right_stride, int* info, std::size_t);
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

bool SinglePrecisionLu::compute(const Eigen::MatrixXd& matrix) {
  TS_ASSERT(matrix.rows() == matrix.cols());
  one_thread();
  const Eigen::Index n = matrix.rows();
  scale_.resize(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double diagonal = std::abs(matrix(i, i));
    scale_[i] = diagonal > 0.0 ? 1.0 / std::sqrt(diagonal) : 0.0;
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    if (scale_[i] > 0.0) continue;  // a row of the border
    const double largest = matrix.row(i).transpose().cwiseProduct(scale_).cwiseAbs().maxCoeff();
    scale_[i] = largest > 0.0 ? 1.0 / largest : 1.0;
  }
  if (!scale_.allFinite()) return false;
  factor_.resize(n, n);
  for (Eigen::Index j = 0; j < n; ++j) {
    factor_.col(j) = (scale_[j] * scale_.cwiseProduct(matrix.col(j))).cast<float>();
  }
  const int size = static_cast<int>(factor_.rows());
  pivots_.resize(size);
  int info = 0;
  if (size > 0) sgetrf_(&size, &size, factor_.data(), &size, pivots_.data(), &info);
  return info == 0;
}

Eigen::VectorXd SinglePrecisionLu::solve(const Eigen::VectorXd& right) const {
  const int size = static_cast<int>(factor_.rows());
  TS_ASSERT(right.size() == size);
  Eigen::VectorXd scaled = scale_.cwiseProduct(right);
  // Single precision has few exponents: what is solved for is of the order of one.
  const double largest = size > 0 ? scaled.cwiseAbs().maxCoeff() : 0.0;
  if (!(largest > 0.0)) return scaled;
  Eigen::VectorXf result = (scaled / largest).cast<float>();
  const int one = 1;
  int info = 0;
  sgetrs_("N", &size, &one, factor_.data(), &size, pivots_.data(), result.data(), &size, &info, 1);
  return largest * scale_.cwiseProduct(result.cast<double>());
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
