#include "fem/elements/dense_product.h"

#include <cstddef>

#include "core/error.h"

extern "C" {
void openblas_set_num_threads(int);
int openblas_get_num_threads(void);
void dgemm_(const char* transposed_a, const char* transposed_b, const int* rows, const int* columns, const int* inner,
            const double* scale, const double* a, const int* a_stride, const double* b, const int* b_stride,
            const double* keep, double* c, const int* c_stride, std::size_t, std::size_t);
void sgemm_(const char* transposed_a, const char* transposed_b, const int* rows, const int* columns, const int* inner,
            const float* scale, const float* a, const int* a_stride, const float* b, const int* b_stride,
            const float* keep, float* c, const int* c_stride, std::size_t, std::size_t);
}

namespace touchstone::fem {
namespace {

template <typename Matrix, typename Multiply>
Matrix product(const Eigen::Ref<const Matrix>& a, const Eigen::Ref<const Matrix>& b, Transposed transposed,
               const Multiply& multiply) {
  const bool first = transposed == Transposed::first;
  const bool second = transposed == Transposed::second;
  const int rows = static_cast<int>(first ? a.cols() : a.rows());
  const int inner = static_cast<int>(first ? a.rows() : a.cols());
  const int columns = static_cast<int>(second ? b.rows() : b.cols());
  TS_ASSERT(inner == (second ? b.cols() : b.rows()));
  Matrix result = Matrix::Zero(rows, columns);
  if (rows == 0 || columns == 0 || inner == 0) return result;
  if (openblas_get_num_threads() != 1) openblas_set_num_threads(1);
  const int a_stride = static_cast<int>(a.outerStride());
  const int b_stride = static_cast<int>(b.outerStride());
  const typename Matrix::Scalar one = 1;
  const typename Matrix::Scalar zero = 0;
  multiply(first ? "T" : "N", second ? "T" : "N", &rows, &columns, &inner, &one, a.data(), &a_stride, b.data(),
           &b_stride, &zero, result.data(), &rows, 1, 1);
  return result;
}

}  // namespace

Eigen::MatrixXd product_of(const Eigen::Ref<const Eigen::MatrixXd>& a, const Eigen::Ref<const Eigen::MatrixXd>& b,
                           Transposed transposed) {
  return product<Eigen::MatrixXd>(a, b, transposed, dgemm_);
}

Eigen::MatrixXf product_of(const Eigen::Ref<const Eigen::MatrixXf>& a, const Eigen::Ref<const Eigen::MatrixXf>& b,
                           Transposed transposed) {
  return product<Eigen::MatrixXf>(a, b, transposed, sgemm_);
}

}  // namespace touchstone::fem
