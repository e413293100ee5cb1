#include "tests/support/half_space_gel.h"

#include <Eigen/Geometry>
#include <cmath>

#include "core/units.h"

namespace touchstone::test {
namespace {

constexpr double kDepthOfResponse = 0.28;

/// Displacement at (x, y) of the surface by unit forces at the origin, smoothed over e. In Fourier space it is
/// Boussinesq's and Cerruti's solution times exp(-e k), hence positive definite.
Eigen::Matrix3d response(double x, double y, double e, double shear_modulus, double nu) {
  const double rho = std::sqrt(x * x + y * y + e * e);
  const double sum = rho + e;
  const double pull = 1.0 / (rho * sum * sum);
  const double couple = (1.0 - 2.0 * nu) / (2.0 * rho * sum);
  Eigen::Matrix3d g;
  g(0, 0) = 1.0 / rho - nu * (1.0 / sum - x * x * pull);
  g(1, 1) = 1.0 / rho - nu * (1.0 / sum - y * y * pull);
  g(0, 1) = g(1, 0) = nu * x * y * pull;
  g(2, 2) = (1.0 - nu) / rho;
  // Force along +z (outwards) draws the surface in towards it when pressed, and the converse.
  g(2, 0) = couple * x;
  g(0, 2) = -couple * x;
  g(2, 1) = couple * y;
  g(1, 2) = -couple * y;
  return g / (2.0 * kPi * shear_modulus);
}

}  // namespace

Eigen::SparseMatrix<double> surface_mass(const std::vector<Eigen::Vector3d>& vertices,
                                         const std::vector<std::array<int, 3>>& triangles) {
  std::vector<Eigen::Triplet<double>> entries;
  for (const auto& t : triangles) {
    const double area = 0.5 * (vertices[t[1]] - vertices[t[0]]).cross(vertices[t[2]] - vertices[t[0]]).norm();
    for (int a = 0; a < 3; ++a) {
      for (int b = 0; b < 3; ++b) entries.emplace_back(t[a], t[b], area * (a == b ? 1.0 / 6.0 : 1.0 / 12.0));
    }
  }
  const auto n = static_cast<Eigen::Index>(vertices.size());
  Eigen::SparseMatrix<double> mass(n, n);
  mass.setFromTriplets(entries.begin(), entries.end());
  return mass;
}

fem::Compliance half_space_gel(double half_width, double spacing, const fem::ElasticMaterial& material,
                               double thickness) {
  fem::Compliance gel;
  gel.thickness = thickness;
  gel.material = material;
  const int half = static_cast<int>(std::lround(half_width / spacing));
  const int side = 2 * half + 1;
  for (int j = 0; j < side; ++j) {
    for (int i = 0; i < side; ++i) gel.vertices.emplace_back((i - half) * spacing, (j - half) * spacing, 0.0);
  }
  for (int j = 0; j + 1 < side; ++j) {
    for (int i = 0; i + 1 < side; ++i) {
      const int a = j * side + i;
      const int b = a + 1;
      const int c = a + side;
      const int d = c + 1;
      // Diagonals mirrored about both axes, so that the grid has the symmetry of its problems.
      if ((i < half) == (j < half)) {
        gel.triangles.push_back({a, b, d});
        gel.triangles.push_back({a, d, c});
      } else {
        gel.triangles.push_back({a, b, c});
        gel.triangles.push_back({b, d, c});
      }
    }
  }
  gel.mass = surface_mass(gel.vertices, gel.triangles);
  const auto n = static_cast<Eigen::Index>(gel.vertices.size());
  const Eigen::VectorXd weight = gel.mass * Eigen::VectorXd::Ones(n);
  const double shear_modulus = material.youngs_modulus / (2.0 * (1.0 + material.poisson_ratio));
  Eigen::MatrixXd surface(3 * n, 3 * n);
  for (Eigen::Index j = 0; j < n; ++j) {
    for (Eigen::Index i = 0; i < n; ++i) {
      const Eigen::Vector3d between = gel.vertices[i] - gel.vertices[j];
      surface.block<3, 3>(3 * i, 3 * j) =
          weight[i] * weight[j] *
          response(between.x(), between.y(), kDepthOfResponse * spacing, shear_modulus, material.poisson_ratio);
    }
  }
  gel.surface = std::move(surface);
  gel.beads = Eigen::MatrixXd(0, 3 * n);
  return gel;
}

}  // namespace touchstone::test
