#pragma once
// Few rows of a matrix that its other rows are made of.

#include <Eigen/Core>
#include <vector>

namespace touchstone::fem {

/// matrix(others, all) ~ from * matrix(kept, all)
struct RowSkeleton {
  std::vector<int> kept;    ///< rising
  std::vector<int> others;  ///< rising
  Eigen::MatrixXd from;     ///< others x kept
};

/// As few rows as are needed for the others to be combinations of them: each column divided by its `scale`, what is
/// left out is at most `tolerance` (Frobenius). By a Cholesky factor with pivoting of the rows' products with each
/// other, an interpolative decomposition [Cheng2005]; so nothing below some 1e-7 of the matrix is seen, and tolerances
/// below that keep all rows. The same input gives the same bytes.
RowSkeleton row_skeleton(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& scale, double tolerance);

}  // namespace touchstone::fem
