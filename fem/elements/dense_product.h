#pragma once
// Products of dense matrices by OpenBLAS, which uses the processor's wide registers; the program is compiled for any.

#include <Eigen/Core>

namespace touchstone::fem {
/// Which of a product's factors is.
enum class Transposed { none, first, second };

/// a b, a^T b or a b^T, on one thread: the same input gives the same bytes. Each column's numbers lie one after the
/// other.
Eigen::MatrixXd product_of(const Eigen::Ref<const Eigen::MatrixXd>& a, const Eigen::Ref<const Eigen::MatrixXd>& b,
                           Transposed transposed = Transposed::none);
/// The same in single precision.
Eigen::MatrixXf product_of(const Eigen::Ref<const Eigen::MatrixXf>& a, const Eigen::Ref<const Eigen::MatrixXf>& b,
                           Transposed transposed = Transposed::none);

}  // namespace touchstone::fem
