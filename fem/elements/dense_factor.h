#pragma once
// Dense factorisations by LAPACK (OpenBLAS, held to one thread), for systems of a few hundred unknowns.

#include <Eigen/Core>
#include <vector>

namespace touchstone::fem {

/// A = P L U with partial pivoting in single precision (sgetrf), rows and columns scaled: twice as fast as in double,
/// and enough for the steps of an iteration that corrects itself.
class SinglePrecisionLu {
 public:
  /// False if the square matrix is singular, or as good as.
  bool compute(const Eigen::MatrixXd& matrix);
  /// To some five digits, fewer where the matrix is badly conditioned.
  Eigen::VectorXd solve(const Eigen::VectorXd& right) const;
  Eigen::Index size() const { return factor_.rows(); }

 private:
  Eigen::MatrixXf factor_;
  Eigen::VectorXd scale_;  ///< of rows and columns
  std::vector<int> pivots_;
};

/// A = L L^T of a symmetric positive definite matrix (dpotrf).
class DenseCholesky {
 public:
  /// Takes the matrix over; only its lower half is read. False if it isn't positive definite.
  bool compute(Eigen::MatrixXd matrix);
  /// A^-1 right, column by column. @pre compute() gave true
  Eigen::MatrixXd solve(Eigen::MatrixXd right) const;

 private:
  Eigen::MatrixXd factor_;
};

}  // namespace touchstone::fem
