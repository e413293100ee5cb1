#pragma once
// Dense factorisations by LAPACK (OpenBLAS, held to one thread), for systems of a few hundred unknowns.

#include <Eigen/Core>
#include <vector>

namespace touchstone::fem {

/// A = P L U with partial pivoting (dgetrf).
class DenseLu {
 public:
  /// Takes the square matrix over. False if it's singular to working precision.
  bool compute(Eigen::MatrixXd matrix);
  Eigen::VectorXd solve(const Eigen::VectorXd& right) const;
  Eigen::Index size() const { return factor_.rows(); }

 private:
  Eigen::MatrixXd factor_;
  std::vector<int> pivots_;
};

/// A = L L^T of a symmetric positive definite matrix (dpotrf).
class DenseCholesky {
 public:
  /// Takes the matrix over; only its lower half is read. False if it isn't positive definite.
  bool compute(Eigen::MatrixXd matrix);
  Eigen::MatrixXd solve(Eigen::MatrixXd right) const;

 private:
  Eigen::MatrixXd factor_;
};

}  // namespace touchstone::fem
