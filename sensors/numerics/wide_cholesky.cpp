#include "sensors/numerics/wide_cholesky.h"

#include <algorithm>
#include <cmath>

#include "core/dense_solvers.h"
#include "core/error.h"
#include "sensors/numerics/wide_product.h"
#if defined(__SSE2__)
#include <xmmintrin.h>
#endif

namespace touchstone::sensors {
namespace {

constexpr Eigen::Index kBlock = 128;

/// While it lives, results below 2e-308 are zeros on this thread. A kernel of short lengths has a factor full of them,
/// and each would cost a hundred operations: beside a diagonal that isn't as small they say nothing.
class ZeroSubnormals {
 public:
#if defined(__SSE2__)
  ZeroSubnormals() : before_(_mm_getcsr()) {
    _mm_setcsr(before_ | kFlushToZero | kSubnormalsAreZero);
  }
  ~ZeroSubnormals() {
    _mm_setcsr(before_);
  }
  ZeroSubnormals(const ZeroSubnormals&) = delete;
  ZeroSubnormals& operator=(const ZeroSubnormals&) = delete;

 private:
  static constexpr unsigned kFlushToZero = 0x8000;
  static constexpr unsigned kSubnormalsAreZero = 0x0040;
  unsigned before_;
#endif
};

}  // namespace

bool factorise_in_place(Eigen::MatrixXd& a) {
  TS_ASSERT(a.rows() == a.cols());
  const Eigen::Index n = a.rows();
  [[maybe_unused]] const ZeroSubnormals guard;
  for (Eigen::Index k = 0; k < n; k += kBlock) {
    const Eigen::Index size = std::min(kBlock, n - k);
    const Eigen::Index below = n - k - size;
    // What is left of this block column, all at once: the inner index runs over all before it.
    if (k > 0) {
      subtract_product(a.block(k, k, size, size), a.block(k, 0, size, k), a.block(k, 0, size, k), ProductPart::kLower);
      if (below > 0)
        subtract_product(a.block(k + size, k, below, size), a.block(k + size, 0, below, k), a.block(k, 0, size, k));
    }
    const Eigen::LLT<Eigen::MatrixXd> diagonal(Eigen::MatrixXd(a.block(k, k, size, size)));
    if (diagonal.info() != Eigen::Success) return false;
    a.block(k, k, size, size) = diagonal.matrixL();
    if (!a.block(k, k, size, size).diagonal().allFinite()) return false;
    a.block(0, k, k, size).setZero();
    if (below > 0) {
      a.block(k, k, size, size)
          .triangularView<Eigen::Lower>()
          .transpose()
          .solveInPlace<Eigen::OnTheRight>(a.block(k + size, k, below, size));
    }
  }
  return true;
}

Eigen::VectorXd solve_by_factor(const Eigen::MatrixXd& l, const Eigen::VectorXd& b) {
  TS_ASSERT(l.rows() == l.cols() && l.rows() == b.size());
  Eigen::VectorXd x = l.triangularView<Eigen::Lower>().solve(b);
  l.triangularView<Eigen::Lower>().transpose().solveInPlace(x);
  return x;
}

Eigen::MatrixXd inverse_by_factor(const Eigen::MatrixXd& l) {
  TS_ASSERT(l.rows() == l.cols());
  const Eigen::Index n = l.rows();
  [[maybe_unused]] const ZeroSubnormals guard;
  // Z = L^-T, upper triangular, block column by block column: Z_i = (I - sum over j < i of Z_j L_ij^T) L_ii^-T.
  Eigen::MatrixXd z = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index i = 0; i < n; i += kBlock) {
    const Eigen::Index size = std::min(kBlock, n - i);
    z.block(i, i, size, size).setIdentity();
    if (i > 0) subtract_product(z.block(0, i, i, size), z.topLeftCorner(i, i), l.block(i, 0, size, i));
    l.block(i, i, size, size)
        .triangularView<Eigen::Lower>()
        .transpose()
        .solveInPlace<Eigen::OnTheRight>(z.block(0, i, i + size, size));
  }
  // (L L^T)^-1 = Z Z^T, where row i of Z begins at column i.
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index i = 0; i < n; i += kBlock) {
    const Eigen::Index size = std::min(kBlock, n - i);
    const auto row = z.block(i, i, size, n - i);
    subtract_product(inverse.block(i, 0, size, i + size), row, z.block(0, i, i + size, n - i));
  }
  inverse = -inverse;
  inverse.triangularView<Eigen::StrictlyUpper>().setZero();
  return inverse;
}

double half_log_determinant(const Eigen::MatrixXd& l) {
  double sum = 0.0;
  for (Eigen::Index i = 0; i < l.rows(); ++i) sum += std::log(l(i, i));
  return sum;
}

}  // namespace touchstone::sensors
