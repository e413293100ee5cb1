#pragma once

#include <Eigen/Core>

namespace touchstone::fem {

/// a z, without the columns that meet zeros where these are the most of z.
inline Eigen::VectorXd times_sparse(const Eigen::Ref<const Eigen::MatrixXd>& a, const Eigen::VectorXd& z) {
  if (2 * (z.array() != 0.0).count() > z.size()) return a * z;
  Eigen::VectorXd result = Eigen::VectorXd::Zero(a.rows());
  for (Eigen::Index j = 0; j < z.size(); ++j) {
    if (z[j] != 0.0) result += z[j] * a.col(j);
  }
  return result;
}

}  // namespace touchstone::fem
