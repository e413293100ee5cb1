#pragma once
// Gauss and Legendre's quadrature.

#include <Eigen/Core>

namespace touchstone {

/// Nodes and weights on [0, 1], from 0 to 1; the weights add up to 1.
struct GaussRule {
  Eigen::VectorXd nodes, weights;
};

/// The rule of `count` nodes, exact for polynomials up to degree 2 count - 1: by Newton's steps on the Legendre
/// polynomial. @pre count > 0
GaussRule gauss_rule(int count);

}  // namespace touchstone
