#include "fem/elements/taylor_hood.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/error.h"
#include "tests/fem/mesh/box_mesh.h"

namespace touchstone::fem {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Over the nodes, any component.
double largest_error(const TaylorHoodSpace& space, const ElasticSolution& solution,
                     const std::function<Vector3d(const Vector3d&)>& exact) {
  double error = 0.0;
  for (int node = 0; node < space.nodes; ++node) {
    error = std::max(error,
                     (solution.displacement.row(node).transpose() - exact(space.position(node))).cwiseAbs().maxCoeff());
  }
  return error;
}

/// A linear displacement without special directions. At nu = 0.5 only one without change of volume has finite stress.
Matrix3d some_gradient(double nu) {
  Matrix3d gradient;
  gradient << 0.010, -0.020, 0.005, 0.013, -0.004, 0.017, -0.008, 0.006, 0.011;
  if (nu > 0.4999) {
    gradient.diagonal().array() -= gradient.trace() / 3.0;
  }
  return gradient;
}

TEST(TaylorHood, PatchTest) {
  const TetMesh mesh = fixtures::box_mesh({3, 2, 1.5}, 3, 3, 2, 0.15);
  const TaylorHoodSpace space = make_space(mesh);
  for (const double nu : {0.0, 0.05, 0.3, 0.49, 0.4999, 0.5}) {
    const ElasticMaterial material{0.33, nu};
    const Matrix3d gradient = some_gradient(nu);
    const Vector3d offset(0.1, -0.2, 0.05);
    const double hydrostatic = 0.07;  // MPa: at nu = 0.5 the pressure is free
    Matrix3d stress = shear_modulus(material) * (gradient + gradient.transpose());
    stress += (nu > 0.4999 ? -hydrostatic : shear_modulus(material) * lame_ratio(material) * gradient.trace()) *
              Matrix3d::Identity();
    const auto exact = [&](const Vector3d& x) -> Vector3d { return gradient * x + offset; };
    ElasticLoads loads;
    loads.bonded_displacement = exact;
    loads.traction = [&](const Vector3d&, const Vector3d& normal) -> Vector3d { return stress * normal; };
    const ElasticSolution solution = solve_elastic(space, material, loads);
    // 0.5 is solved as 0.5 - 1e-8, where p makes a little volume: p / lambda = 1e-8 of 0.6.
    const double allowed = nu > 0.4999 ? 3e-8 : 1e-9 * 0.1;
    EXPECT_LT(largest_error(space, solution, exact), allowed) << nu;
    for (const int element : {0, 17, static_cast<int>(mesh.tetrahedra.size()) - 1}) {
      const Matrix3d found = stress_at(space, material, solution, element, Eigen::Vector4d(0.1, 0.2, 0.3, 0.4));
      EXPECT_LT((found - stress).cwiseAbs().maxCoeff(), (nu > 0.4999 ? 1e-7 : 1e-9) * stress.norm()) << nu;
    }
  }
}

TEST(TaylorHood, PatchTestHoldsOnSlivers) {
  TetMesh mesh = fixtures::box_mesh({3, 2, 1.5}, 3, 3, 3);
  // An inner vertex moved to nearly the plane of its neighbours flattens the elements below it.
  const int inner = (1 * 4 + 1) * 4 + 1;
  mesh.vertices[inner].z() = mesh.vertices[inner].z() + 0.499;
  ASSERT_EQ(fault_of(mesh), "");
  ASSERT_LT(smallest_dihedral_angle(mesh), 0.5 * std::numbers::pi / 180.0);
  const TaylorHoodSpace space = make_space(mesh);
  const ElasticMaterial material{1.0, 0.49};
  const Matrix3d gradient = some_gradient(0.49);
  const Matrix3d stress = shear_modulus(material) * (gradient + gradient.transpose() +
                                                     lame_ratio(material) * gradient.trace() * Matrix3d::Identity());
  ElasticLoads loads;
  loads.bonded_displacement = [&](const Vector3d& x) -> Vector3d { return gradient * x; };
  loads.traction = [&](const Vector3d&, const Vector3d& normal) -> Vector3d { return stress * normal; };
  const ElasticSolution solution = solve_elastic(space, material, loads);
  EXPECT_LT(largest_error(space, solution, loads.bonded_displacement), 1e-9 * 0.1);
}

TEST(TaylorHood, RigidMotionCausesNoStress) {
  const TetMesh mesh = fixtures::box_mesh({3, 2, 1.5}, 3, 2, 2, 0.15);
  const TaylorHoodSpace space = make_space(mesh);
  for (const double nu : {0.0, 0.3, 0.5}) {
    const ElasticMaterial material{0.33, nu};
    const Vector3d spin(0.02, -0.03, 0.05);
    const auto motion = [&](const Vector3d& x) -> Vector3d { return Vector3d(1, 2, -1) + spin.cross(x); };
    ElasticLoads loads;
    loads.bonded_displacement = motion;
    const ElasticSolution solution = solve_elastic(space, material, loads);
    EXPECT_LT(largest_error(space, solution, motion), 1e-12);
    for (int element = 0; element < static_cast<int>(mesh.tetrahedra.size()); element += 5) {
      const Matrix3d stress = stress_at(space, material, solution, element, Eigen::Vector4d::Constant(0.25));
      EXPECT_LT(stress.cwiseAbs().maxCoeff(), 1e-12) << nu;
    }
  }
}

/// u = (z^2, 0, 0), p = 2 G x is in equilibrium without body force at nu = 0.5, and in the element's space.
TEST(TaylorHood, QuadraticFieldWithLinearPressureIsReproduced) {
  const TetMesh mesh = fixtures::box_mesh({3, 2, 1.5}, 3, 2, 2, 0.15);
  const TaylorHoodSpace space = make_space(mesh);
  const ElasticMaterial material{0.33, 0.5};
  const double shear = shear_modulus(material);
  const auto exact = [](const Vector3d& x) -> Vector3d { return {x.z() * x.z(), 0.0, 0.0}; };
  ElasticLoads loads;
  loads.bonded_displacement = exact;
  loads.traction = [&](const Vector3d& x, const Vector3d& normal) -> Vector3d {
    Matrix3d stress = -2.0 * shear * x.x() * Matrix3d::Identity();
    stress(0, 2) = stress(2, 0) = 2.0 * shear * x.z();
    return stress * normal;
  };
  const ElasticSolution solution = solve_elastic(space, material, loads);
  EXPECT_LT(largest_error(space, solution, exact), 2e-7);  // of 2.25; nu is 0.5 - 1e-8
  for (int v = 0; v < space.vertices; ++v) {
    EXPECT_NEAR(solution.pressure[v], 2.0 * shear * mesh.vertices[v].x(), 1e-6);
  }
}

ElasticSolution pressed_patch(const TaylorHoodSpace& space, double nu) {
  ElasticLoads loads;
  loads.traction = [](const Vector3d& x, const Vector3d& normal) -> Vector3d {
    const bool under = normal.z() > 0.9 && std::abs(x.x()) < 0.5 && std::abs(x.y()) < 0.5;
    return under ? Vector3d(0.002, 0.0, -0.01) : Vector3d::Zero();
  };
  return solve_elastic(space, {0.33, nu}, loads);
}

TEST(TaylorHood, IncompressibleEqualsItsNeighbours) {
  const TetMesh mesh = fixtures::box_mesh({3, 3, 1}, 6, 6, 2, 0.1);
  const TaylorHoodSpace space = make_space(mesh);
  const ElasticSolution limit = pressed_patch(space, 0.5);
  const double size = limit.displacement.cwiseAbs().maxCoeff();
  EXPECT_LT((pressed_patch(space, 0.5 - 1e-8).displacement - limit.displacement).cwiseAbs().maxCoeff(), 1e-7 * size);
  EXPECT_LT((pressed_patch(space, 0.5 - 1e-7).displacement - limit.displacement).cwiseAbs().maxCoeff(), 1e-6 * size);
}

TEST(TaylorHood, SweepOfPoissonsRatioIsSmoothAndDoesntLock) {
  const TetMesh mesh = fixtures::box_mesh({3, 3, 1}, 6, 6, 2, 0.1);
  const TaylorHoodSpace space = make_space(mesh);
  const auto work = [&](double nu) {  // stands for the compliance under the patch
    const ElasticSolution solution = pressed_patch(space, nu);
    return -solution.displacement(((2 * 7) + 3) * 7 + 3, 2);
  };
  // From 0.49 to 0.5 the compliance falls less than from 0.45 to 0.49 and has a finite limit; a locking element loses
  // most of it.
  const double at_45 = work(0.45);
  const double at_49 = work(0.49);
  const double at_499 = work(0.499);
  const double at_4999 = work(0.4999);
  const double at_5 = work(0.5);
  EXPECT_GT(at_45, at_49);
  EXPECT_GT(at_49, at_499);
  EXPECT_GT(at_499, at_4999);
  EXPECT_GT(at_4999, at_5);
  EXPECT_GT(at_5, 0.5 * at_49);
  EXPECT_LT(at_4999 / at_5 - 1.0, 0.01);
  EXPECT_NEAR((at_499 - at_4999) / (at_4999 - at_5), 9.0, 2.0);  // linear in 1 - 2 nu near the limit
}

TEST(TaylorHood, SameMatrixHoweverManyThreads) {
  const TetMesh mesh = fixtures::box_mesh({3, 2, 1}, 4, 3, 2, 0.1);
  const TaylorHoodSpace space = make_space(mesh);
  const Scales scales = make_scales(mesh, {1.0, 0.4});
  const SymmetricEntries first = assemble(space, scales);
  for (int repeat = 0; repeat < 5; ++repeat) {  // TBB cuts the loop differently each time
    const SymmetricEntries again = assemble(space, scales);
    EXPECT_EQ(first.values, again.values);
    EXPECT_EQ(first.rows, again.rows);
    EXPECT_EQ(first.columns, again.columns);
  }
}

TEST(TaylorHood, UnfitMeshIsRefusedByName) {
  TetMesh mesh = fixtures::box_mesh({1, 1, 1}, 1, 1, 1);
  mesh.vertices[0].x() = std::numeric_limits<double>::quiet_NaN();
  try {
    make_space(mesh);
    FAIL() << "not refused";
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "the gel's mesh can't be used: vertex 0 isn't finite");
  }
}

}  // namespace
}  // namespace touchstone::fem
