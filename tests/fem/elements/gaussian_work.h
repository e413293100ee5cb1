#pragma once

#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <cmath>

#include "fem/elements/compliance.h"
#include "fem/elements/quadrature.h"

namespace touchstone::fem::fixtures {

/// Work of the pressure exp(-r^2 / (2 s^2)), projected onto the surface's hats, over the displacement it causes.
inline double gaussian_work(const Compliance& gel, double s) {
  const auto n = static_cast<Eigen::Index>(gel.vertices.size());
  Eigen::VectorXd moments = Eigen::VectorXd::Zero(n);
  for (const auto& triangle : gel.triangles) {
    const Eigen::Vector3d& a = gel.vertices[triangle[0]];
    const Eigen::Vector3d& b = gel.vertices[triangle[1]];
    const Eigen::Vector3d& c = gel.vertices[triangle[2]];
    const double area = 0.5 * (b - a).cross(c - a).norm();
    for (const auto& point : triangle_rule(6)) {
      const Eigen::Vector3d x = point.barycentric[0] * a + point.barycentric[1] * b + point.barycentric[2] * c;
      for (int k = 0; k < 3; ++k) {
        moments[triangle[k]] += point.weight * area * point.barycentric[k] * std::exp(-x.squaredNorm() / (2.0 * s * s));
      }
    }
  }
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> mass(gel.mass);
  const Eigen::VectorXd pressure = mass.solve(moments);
  Eigen::VectorXd traction = Eigen::VectorXd::Zero(3 * n);
  for (Eigen::Index i = 0; i < n; ++i) {
    traction[3 * i + 2] = -pressure[i];
  }
  return traction.dot(gel.surface.view() * traction);
}

}  // namespace touchstone::fem::fixtures
