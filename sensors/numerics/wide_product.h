#pragma once
// Products of large dense matrices for training: as wide as the processor's registers, and the same bits whatever they
// are.
//
// The build is for any x86-64, where Eigen's product doesn't use what newer processors can do: a Cholesky factor of
// 4000 rows ran at 10.9 GF/s with Eigen, at 24.7 with this and at 34.1 with an OpenBLAS that takes the processor for
// what it is (Xeon of family 6, model 143, one of four busy cores, thread time, double precision; 10.1 to 11.6, 22 to
// 25 and 28 to 35 from run to run). Here every entry is a sum over the inner index in the same blocks and the same
// order in each of the forms, without fused multiplications, so that it has the same bits on every processor, which no
// BLAS has; and nobody who links the estimators needs one.

#include <Eigen/Core>
#include <cstdint>

namespace touchstone::sensors {

/// Which part of the result is wanted.
enum class ProductPart : std::uint8_t {
  kAll,
  kLower,  ///< on and below the diagonal; above it c is left as it was, or written in parts
};

/// c -= a b^T. Allocates two blocks (together under 1 MB). @pre sizes fit; c overlaps neither a nor b; for kLower c is
/// square
void subtract_product(Eigen::Ref<Eigen::MatrixXd> c, const Eigen::Ref<const Eigen::MatrixXd>& a,
                      const Eigen::Ref<const Eigen::MatrixXd>& b, ProductPart part = ProductPart::kAll);

}  // namespace touchstone::sensors
