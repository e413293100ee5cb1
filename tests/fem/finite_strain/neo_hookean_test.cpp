#include "fem/finite_strain/neo_hookean.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

namespace touchstone::fem {
namespace {

using Eigen::Matrix3d;

NeoHookean material_of(double nu) {
  TetMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh.tetrahedra = {{0, 1, 2, 3}};
  return make_scales(mesh, ElasticMaterial{0.33, nu}).regions[0];
}

constexpr double kRatios[] = {0.0, 0.2, 0.3, 0.45, 0.49, 0.5};

/// Entries uniform in [-size, size], each its own.
Matrix3d some_matrix(int index, double size) {
  Matrix3d matrix;
  for (int k = 0; k < 9; ++k) {
    const double x = 12.9898 * (index + 1) + 78.233 * (k + 1);
    matrix(k / 3, k % 3) = size * std::sin(37.0 * std::sin(x));
  }
  return matrix;
}

Matrix3d some_deformation(int index) {
  Matrix3d gradient = Matrix3d::Identity() + some_matrix(index, 0.35);
  EXPECT_GT(gradient.determinant(), 0.1);
  return gradient;
}

TEST(NeoHookean, StressIsTheDerivativeOfEnergy) {
  constexpr double kStep = 1e-5;
  for (const double nu : kRatios) {
    const NeoHookean material = material_of(nu);
    for (int index = 0; index < 20; ++index) {
      const Matrix3d gradient = some_deformation(index);
      const double q = std::sin(5.0 * index);
      const NeoHookeanStress found = stress(material, gradient, q);
      for (int k = 0; k < 9; ++k) {
        Matrix3d change = Matrix3d::Zero();
        change(k / 3, k % 3) = kStep;
        const double slope =
            (energy(material, gradient + change, q) - energy(material, gradient - change, q)) / (2 * kStep);
        EXPECT_NEAR(found.stress(k / 3, k % 3), slope, 1e-7);
      }
      const double slope =
          (energy(material, gradient, q + kStep) - energy(material, gradient, q - kStep)) / (2 * kStep);
      EXPECT_NEAR(found.volume, slope, 1e-9);
    }
  }
}

TEST(NeoHookean, TangentIsTheDerivativeOfStressAndSymmetric) {
  constexpr double kStep = 1e-5;
  for (const double nu : kRatios) {
    const NeoHookean material = material_of(nu);
    for (int index = 0; index < 20; ++index) {
      const Matrix3d gradient = some_deformation(index);
      const double q = std::sin(5.0 * index);
      const Matrix3d one = some_matrix(100 + index, 1.0);
      const Matrix3d other = some_matrix(200 + index, 1.0);
      const NeoHookeanStress found = stress_change(material, gradient, q, one, 0.7);
      const NeoHookeanStress up = stress(material, gradient + kStep * one, q + kStep * 0.7);
      const NeoHookeanStress down = stress(material, gradient - kStep * one, q - kStep * 0.7);
      EXPECT_LT((found.stress - (up.stress - down.stress) / (2 * kStep)).norm(), 1e-7 * found.stress.norm());
      EXPECT_NEAR(found.volume, (up.volume - down.volume) / (2 * kStep), 1e-8);
      const NeoHookeanStress back = stress_change(material, gradient, q, other, -0.4);
      const double forth_work = found.stress.cwiseProduct(other).sum() - 0.4 * found.volume;
      const double back_work = back.stress.cwiseProduct(one).sum() + 0.7 * back.volume;
      EXPECT_NEAR(forth_work, back_work, 1e-12 * (1.0 + std::abs(forth_work)));
    }
  }
}

TEST(NeoHookean, ARotationChangesNothing) {
  const Matrix3d turn = Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
  for (const double nu : kRatios) {
    const NeoHookean material = material_of(nu);
    for (int index = 0; index < 20; ++index) {
      const Matrix3d gradient = some_deformation(index);
      // Seen from elsewhere, and for an isotropic material also when turned before it is strained.
      EXPECT_NEAR(energy(material, turn * gradient, 0.3), energy(material, gradient, 0.3), 1e-13);
      EXPECT_NEAR(energy(material, gradient * turn, 0.3), energy(material, gradient, 0.3), 1e-13);
      EXPECT_LT((stress(material, turn * gradient, 0.3).stress - turn * stress(material, gradient, 0.3).stress).norm(),
                1e-12);
    }
    EXPECT_LT(stress(material, turn, 0.0).stress.norm(), 1e-14);
  }
}

TEST(NeoHookean, IsLinearElasticityAtSmallStrain) {
  for (const double nu : kRatios) {
    const NeoHookean material = material_of(nu);
    const Matrix3d change = some_matrix(3, 1.0);
    const NeoHookeanStress found = stress_change(material, Matrix3d::Identity(), 0.0, change, 0.6);
    const Matrix3d expected =
        change + change.transpose() - 0.6 * material.pressure_scale * Matrix3d::Identity();  // 2 eps - p I, over G
    EXPECT_LT((found.stress - expected).norm(), 1e-14);
    EXPECT_NEAR(found.volume, -material.pressure_scale * change.trace() - 0.6 * material.compressibility, 1e-14);
  }
}

/// Incompressible uniaxial stretch: Cauchy stress G (l^2 - 1/l). Simple shear: G k, and a normal stress difference G
/// k^2.
TEST(NeoHookean, ClosedFormsOfStretchAndShear) {
  const NeoHookean material = material_of(0.5);
  for (const double stretch : {0.5, 0.8, 1.3, 2.0}) {
    const Matrix3d gradient = Eigen::Vector3d(stretch, 1 / std::sqrt(stretch), 1 / std::sqrt(stretch)).asDiagonal();
    const double free = 1.0 / stretch - 1.0;  // the pressure that leaves the sides free of stress
    const Matrix3d cauchy = stress(material, gradient, free / material.pressure_scale).stress * gradient.transpose();
    EXPECT_NEAR(cauchy(0, 0), stretch * stretch - 1.0 / stretch, 1e-13);
    EXPECT_NEAR(cauchy(1, 1), 0.0, 1e-13);
  }
  for (const double shear : {0.1, 0.7, 1.5}) {
    Matrix3d gradient = Matrix3d::Identity();
    gradient(0, 2) = shear;
    const Matrix3d cauchy = stress(material, gradient, 0.0).stress * gradient.transpose();
    EXPECT_NEAR(cauchy(0, 2), shear, 1e-14);
    EXPECT_NEAR(cauchy(2, 0), shear, 1e-14);
    EXPECT_NEAR(cauchy(0, 0) - cauchy(2, 2), shear * shear, 1e-13);
  }
}

TEST(NeoHookean, AnInvertedStateHasInfiniteEnergy) {
  const NeoHookean material = material_of(0.49);
  const Matrix3d mirrored = Eigen::Vector3d(1, 1, -0.5).asDiagonal();
  EXPECT_TRUE(std::isinf(energy(material, mirrored, 0.0)));
}

}  // namespace
}  // namespace touchstone::fem
