#pragma once

#include <Eigen/Core>

namespace touchstone::sensors {

/// Factor L of a symmetric positive definite matrix A = L L^T, blocked over sensors/numerics/wide_product.h: the same
/// bits on every processor and any number of threads. Only A's lower triangle is read; L takes its place, and zeros
/// what is above it. Returns false where A isn't positive definite to rounding; A is then spoiled. @pre A is square
[[nodiscard]] bool factorise_in_place(Eigen::MatrixXd& a);

/// Solves L L^T x = b. @pre sizes fit
Eigen::VectorXd solve_by_factor(const Eigen::MatrixXd& l, const Eigen::VectorXd& b);

/// The lower triangle of (L L^T)^-1, with zeros above. @pre L is lower triangular with a positive diagonal
Eigen::MatrixXd inverse_by_factor(const Eigen::MatrixXd& l);

/// Sum of the logarithms of L's diagonal: half of log det A.
double half_log_determinant(const Eigen::MatrixXd& l);

}  // namespace touchstone::sensors
