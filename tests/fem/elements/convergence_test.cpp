// Errors fall with the mesh as the theory of the element says: displacement O(h^3) and pressure O(h^2) in L2
// [Boffi2013, sec. 8.8].

#include <gtest/gtest.h>

#include <cmath>

#include "fem/elements/quadrature.h"
#include "fem/elements/taylor_hood.h"
#include "tests/fem/mesh/box_mesh.h"

namespace touchstone::fem {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// A smooth field without change of volume, and a smooth pressure: u = curl of (0, 0, s) + curl of (s', 0, 0).
struct Exact {
  double shear;
  static constexpr double k = 1.3;

  Vector3d displacement(const Vector3d& x) const {
    // d/dy, -d/dx of sin(kx) sin(ky) cos(kz), and 0, d/dz, -d/dy of cos(k x) e^z sin(k y).
    const double sx = std::sin(k * x.x()), cx = std::cos(k * x.x());
    const double sy = std::sin(k * x.y()), cy = std::cos(k * x.y());
    const double cz = std::cos(k * x.z()), e = std::exp(x.z());
    return {k * sx * cy * cz, -k * cx * sy * cz + cx * e * sy, -k * cx * e * cy};
  }
  Matrix3d gradient(const Vector3d& x) const {
    const double sx = std::sin(k * x.x()), cx = std::cos(k * x.x());
    const double sy = std::sin(k * x.y()), cy = std::cos(k * x.y());
    const double sz = std::sin(k * x.z()), cz = std::cos(k * x.z()), e = std::exp(x.z());
    Matrix3d g;
    g << k * k * cx * cy * cz, -k * k * sx * sy * cz, -k * k * sx * cy * sz,  //
        k * k * sx * sy * cz - k * sx * e * sy, -k * k * cx * cy * cz + k * cx * e * cy,
        k * k * cx * sy * sz + cx * e * sy, k * k * sx * e * cy, k * k * cx * e * sy, -k * cx * e * cy;
    return g;
  }
  double pressure(const Vector3d& x) const { return shear * std::sin(x.x() + 2.0 * x.y()) * std::cos(x.z()); }
  /// f = -div(2 G eps) + grad p = -G laplace u + grad p, as div u = 0.
  Vector3d body_force(const Vector3d& x) const {
    const double cx = std::cos(k * x.x()), sx = std::sin(k * x.x());
    const double cy = std::cos(k * x.y()), sy = std::sin(k * x.y());
    const double cz = std::cos(k * x.z()), e = std::exp(x.z());
    const Vector3d first(k * sx * cy * cz, -k * cx * sy * cz, 0.0);  // eigenvalue -3 k^2 of the Laplacian
    const Vector3d second(0.0, cx * e * sy, -k * cx * e * cy);       // 1 - 2 k^2
    const Vector3d laplace = -3.0 * k * k * first + (1.0 - 2.0 * k * k) * second;
    const double c = std::cos(x.x() + 2.0 * x.y());
    const double s = std::sin(x.x() + 2.0 * x.y());
    return -shear * laplace + shear * Vector3d(c * std::cos(x.z()), 2.0 * c * std::cos(x.z()), -s * std::sin(x.z()));
  }
};

struct Errors {
  double displacement = 0.0;
  double pressure = 0.0;
};

Errors errors_on(int cells, const ElasticMaterial& material) {
  const TetMesh mesh = fixtures::box_mesh({2, 2, 2}, cells, cells, cells, 0.1);
  const TaylorHoodSpace space = make_space(mesh);
  const Exact exact{shear_modulus(material)};
  ElasticLoads loads;
  loads.bonded_displacement = [&](const Vector3d& x) { return exact.displacement(x); };
  loads.body_force = [&](const Vector3d& x) { return exact.body_force(x); };
  loads.traction = [&](const Vector3d& x, const Vector3d& normal) -> Vector3d {
    const Matrix3d g = exact.gradient(x);
    return exact.shear * (g + g.transpose()) * normal - exact.pressure(x) * normal;
  };
  const ElasticSolution solution = solve_elastic(space, material, loads);
  Errors sum;
  for (int e = 0; e < static_cast<int>(mesh.tetrahedra.size()); ++e) {
    const double size = volume(mesh, mesh.tetrahedra[e]);
    for (const auto& point : tetrahedron_rule(6)) {
      Vector3d x = Vector3d::Zero();
      for (int k = 0; k < 4; ++k) {
        x += point.barycentric[k] * mesh.vertices[mesh.tetrahedra[e][k]];
      }
      sum.displacement +=
          point.weight * size *
          (displacement_at(space, solution, e, point.barycentric) - exact.displacement(x)).squaredNorm();
      sum.pressure +=
          point.weight * size * std::pow(pressure_at(space, solution, e, point.barycentric) - exact.pressure(x), 2);
    }
  }
  return {std::sqrt(sum.displacement), std::sqrt(sum.pressure) / exact.shear};
}

TEST(TaylorHoodConvergence, DisplacementIsThirdAndPressureSecondOrder) {
  const ElasticMaterial material{1.0, 0.5};
  const Errors coarse = errors_on(4, material);
  const Errors fine = errors_on(8, material);
  EXPECT_GT(std::log2(coarse.displacement / fine.displacement), 2.7);
  EXPECT_GT(std::log2(coarse.pressure / fine.pressure), 1.8);
  EXPECT_LT(fine.displacement, 0.02);
}

}  // namespace
}  // namespace touchstone::fem
