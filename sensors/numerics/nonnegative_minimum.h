#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "core/dense_solvers.h"

namespace touchstone::sensors {

/// The minimum of x^T H x / 2 - b^T x over all x whose entries with `sign[i]` are at least zero (the others are free).
struct NonnegativeMinimum {
  Eigen::VectorXd x;
  int factorisations = 0;  ///< beside that of H
  bool converged = false;  ///< else x is what the last set of zeros gave, entries below zero made zero
};

/// Block principal pivoting [Judice1994], which begins with no entry held at zero: of a positive definite H it ends at
/// the one minimum. While few entries are held, their forces are found by the factor of all of H, else the free rows
/// are factorised. @pre H is symmetric positive definite, `factor` is its own, sizes fit
NonnegativeMinimum nonnegative_minimum(const Eigen::MatrixXd& H, const Eigen::LLT<Eigen::MatrixXd>& factor,
                                       const Eigen::VectorXd& b, const std::vector<std::uint8_t>& sign);

}  // namespace touchstone::sensors
