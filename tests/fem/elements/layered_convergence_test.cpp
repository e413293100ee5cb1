// Two materials: the order of convergence is that of one (compare convergence_test.cpp).

#include <gtest/gtest.h>

#include <cmath>

#include "fem/elements/quadrature.h"
#include "fem/elements/taylor_hood.h"
#include "tests/fem/mesh/box_mesh.h"

namespace touchstone::fem {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// A smooth displacement without change of volume, mirror-symmetric to the interface z = -1, so that shear vanishes on
/// it; the pressure jumps as the stretch across it times the jump of 2 G: the traction goes on.
struct Exact {
  double lower, upper;  // shear moduli
  static constexpr double k = 1.3;

  double shear(const Vector3d& x) const { return x.z() > -1.0 ? upper : lower; }
  Vector3d displacement(const Vector3d& x) const {
    const double z = x.z() + 1.0;
    const double sx = std::sin(k * x.x()), cx = std::cos(k * x.x());
    const double sy = std::sin(k * x.y()), cy = std::cos(k * x.y());
    const double cz = std::cos(k * z);
    return {k * sx * cy * cz, -k * cx * sy * cz + cx * std::cosh(z) * sy, -k * cx * std::sinh(z) * cy};
  }
  Matrix3d gradient(const Vector3d& x) const {
    const double z = x.z() + 1.0;
    const double sx = std::sin(k * x.x()), cx = std::cos(k * x.x());
    const double sy = std::sin(k * x.y()), cy = std::cos(k * x.y());
    const double sz = std::sin(k * z), cz = std::cos(k * z);
    const double sh = std::sinh(z), ch = std::cosh(z);
    Matrix3d g;
    g << k * k * cx * cy * cz, -k * k * sx * sy * cz, -k * k * sx * cy * sz,  //
        k * k * sx * sy * cz - k * sx * ch * sy, -k * k * cx * cy * cz + k * cx * ch * cy,
        k * k * cx * sy * sz + cx * sh * sy,  //
        k * k * sx * sh * cy, k * k * cx * sh * sy, -k * cx * ch * cy;
    return g;
  }
  double pressure(const Vector3d& x) const {
    return lower * std::sin(x.x() + 2.0 * x.y()) * std::cos(x.z()) -
           2.0 * shear(x) * k * std::cos(k * x.x()) * std::cos(k * x.y());
  }
  Vector3d body_force(const Vector3d& x) const {
    const double z = x.z() + 1.0;
    const double sx = std::sin(k * x.x()), cx = std::cos(k * x.x());
    const double sy = std::sin(k * x.y()), cy = std::cos(k * x.y());
    const double cz = std::cos(k * z);
    const Vector3d first(k * sx * cy * cz, -k * cx * sy * cz, 0.0);
    const Vector3d second(0.0, cx * std::cosh(z) * sy, -k * cx * std::sinh(z) * cy);
    const Vector3d laplace = -3.0 * k * k * first + (1.0 - 2.0 * k * k) * second;
    const double c = std::cos(x.x() + 2.0 * x.y());
    const double s = std::sin(x.x() + 2.0 * x.y());
    const Vector3d smooth = lower * Vector3d(c * std::cos(x.z()), 2.0 * c * std::cos(x.z()), -s * std::sin(x.z()));
    const Vector3d jumping = 2.0 * shear(x) * k * k * Vector3d(sx * cy, cx * sy, 0.0);
    return -shear(x) * laplace + smooth + jumping;
  }
};

struct Errors {
  double displacement = 0.0;
  double pressure = 0.0;
};

Errors errors_on(int cells, const std::vector<ElasticMaterial>& materials) {
  TetMesh mesh = fixtures::box_mesh({2, 2, 2}, cells, cells, cells, 0.1);
  const int plane = (cells + 1) * (cells + 1);
  for (int v = cells / 2 * plane; v < (cells / 2 + 1) * plane; ++v) mesh.vertices[v].z() = -1.0;
  for (const auto& tetrahedron : mesh.tetrahedra) {
    double middle = 0.0;
    for (const int v : tetrahedron) middle += mesh.vertices[v].z() / 4.0;
    mesh.region.push_back(middle > -1.0 ? 1 : 0);
  }
  const TaylorHoodSpace space = make_space(mesh);
  const Exact exact{shear_modulus(materials[0]), shear_modulus(materials[1])};
  ElasticLoads loads;
  loads.bonded_displacement = [&](const Vector3d& x) { return exact.displacement(x); };
  loads.body_force = [&](const Vector3d& x) { return exact.body_force(x); };
  loads.traction = [&](const Vector3d& x, const Vector3d& normal) -> Vector3d {
    const Matrix3d g = exact.gradient(x);
    return exact.shear(x) * (g + g.transpose()) * normal - exact.pressure(x) * normal;
  };
  const ElasticSolution solution = solve_elastic(space, materials, loads);
  Errors sum;
  for (int e = 0; e < static_cast<int>(mesh.tetrahedra.size()); ++e) {
    const double size = volume(mesh, mesh.tetrahedra[e]);
    for (const auto& point : tetrahedron_rule(6)) {
      Vector3d x = Vector3d::Zero();
      for (int k = 0; k < 4; ++k) x += point.barycentric[k] * mesh.vertices[mesh.tetrahedra[e][k]];
      const Vector3d off = displacement_at(space, solution, e, point.barycentric) - exact.displacement(x);
      sum.displacement += point.weight * size * off.squaredNorm();
      sum.pressure +=
          point.weight * size *
          std::pow((pressure_at(space, solution, e, point.barycentric) - exact.pressure(x)) / exact.shear(x), 2);
    }
  }
  return {std::sqrt(sum.displacement), std::sqrt(sum.pressure)};
}

TEST(TwoMaterialsConvergence, DisplacementIsThirdAndPressureSecondOrder) {
  const std::vector<ElasticMaterial> materials = {{1.0, 0.5}, {7.0, 0.5}};
  const Errors coarse = errors_on(4, materials);
  const Errors fine = errors_on(8, materials);
  EXPECT_GT(std::log2(coarse.displacement / fine.displacement), 2.7);
  EXPECT_GT(std::log2(coarse.pressure / fine.pressure), 1.8);
  EXPECT_LT(fine.displacement, 0.02);
}

}  // namespace
}  // namespace touchstone::fem
