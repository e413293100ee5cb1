#pragma once
// Quadrature rules by products of Gauss rules: any degree, positive weights, no tables.

#include <Eigen/Core>
#include <vector>

namespace touchstone::fem {

/// A point of a rule in barycentric coordinates (tetrahedron: 4, triangle: 3) and its weight; the weights sum to one,
/// so that an integral is the sum times the volume or area.
template <int Corners>
struct SimplexPoint {
  Eigen::Matrix<double, Corners, 1> barycentric;
  double weight = 0.0;
};

/// Exact for polynomials up to `degree` (conical product of Gauss-Legendre rules [Stroud1971]).
std::vector<SimplexPoint<4>> tetrahedron_rule(int degree);
/// The same on a triangle.
std::vector<SimplexPoint<3>> triangle_rule(int degree);

/// Walkington's rule of degree 5 with 14 points [Walkington2000]: symmetric in the corners, so that a symmetric mesh
/// keeps its symmetry.
const std::vector<SimplexPoint<4>>& symmetric_tetrahedron_rule();

/// A direction and the solid angle that it stands for.
struct SpherePoint {
  Eigen::Vector3d direction;  ///< unit vector
  double weight = 0.0;
};

/// Mean over the unit sphere, exact for spherical harmonics up to `degree`; the weights sum to one. Symmetric under the
/// mirrors of the three axes.
std::vector<SpherePoint> sphere_rule(int degree);

}  // namespace touchstone::fem
