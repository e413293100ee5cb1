#include "fem/vibration/eigenmodes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>
#include <functional>
#include <limits>

#include "core/error.h"
#include "core/units.h"
#include "fem/elements/surface_coupling.h"
#include "tests/fem/mesh/box_mesh.h"

namespace touchstone::fem {
namespace {

constexpr double kDensity = 1.05e-9;  // tonne/mm^3
constexpr double kModulus = 0.33;     // MPa

/// A round column: the box mesh's square made a disc of `radius`.
TetMesh column_mesh(double radius, double height, int across, int up) {
  TetMesh mesh = fixtures::box_mesh({2.0, 2.0, height}, across, across, up);
  for (Eigen::Vector3d& x : mesh.vertices) {
    const double square_x = x.x() * x.x();
    const double square_y = x.y() * x.y();
    x.x() *= radius * std::sqrt(1.0 - square_y / 2.0);
    x.y() *= radius * std::sqrt(1.0 - square_x / 2.0);
  }
  return mesh;
}

/// Frequency in Hz of the mode with the most of int rho direction(x) . u dV.
double frequency_with_most(const TaylorHoodSpace& space, const Eigenmodes& modes,
                           const std::function<Eigen::Vector3d(const Eigen::Vector3d&)>& direction) {
  const Eigen::SparseMatrix<double> mass = volume_mass(space);
  const auto nodes = static_cast<Eigen::Index>(space.nodes);
  Eigen::MatrixX3d along(nodes, 3);
  for (int i = 0; i < space.nodes; ++i) along.row(i) = direction(space.position(i)).transpose();
  const Eigen::MatrixX3d weighted = mass * along;
  Eigen::Index best = 0;
  double most = 0.0;
  for (Eigen::Index k = 0; k < modes.angular_frequency.size(); ++k) {
    double sum = 0.0;
    for (Eigen::Index i = 0; i < nodes; ++i) sum += weighted.row(i).dot(modes.displacement.col(k).segment<3>(3 * i));
    if (std::abs(sum) > most) {
      most = std::abs(sum);
      best = k;
    }
  }
  return modes.angular_frequency[best] / (2.0 * kPi);
}

/// Stiffness over the free displacements with the pressure eliminated, N/mm, by dense algebra.
Eigen::MatrixXd dense_stiffness(const TaylorHoodSpace& space, const ElasticMaterial& material) {
  const Scales scales = make_scales(*space.mesh, material);
  const SymmetricEntries entries = assemble(space, scales);
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(entries.size, entries.size);
  for (std::size_t k = 0; k < entries.values.size(); ++k) {
    all(entries.rows[k], entries.columns[k]) += entries.values[k];
    if (entries.rows[k] != entries.columns[k]) all(entries.columns[k], entries.rows[k]) += entries.values[k];
  }
  std::vector<int> free;
  for (int node = 0; node < space.nodes; ++node) {
    for (int a = 0; a < 3 && !space.clamped[node]; ++a) free.push_back(space.displacement[node] + a);
  }
  const Eigen::MatrixXd coupling = all(space.pressure, free);
  const Eigen::MatrixXd against = -all(space.pressure, space.pressure);
  const Eigen::MatrixXd stiffness = all(free, free) + coupling.transpose() * against.llt().solve(coupling);
  return stiffness * (scales.stress * scales.length);
}

Eigen::MatrixXd dense_mass(const TaylorHoodSpace& space) {
  const Eigen::MatrixXd nodal = volume_mass(space);
  std::vector<int> free;
  for (int node = 0; node < space.nodes; ++node) {
    if (!space.clamped[node]) free.push_back(node);
  }
  const auto n = static_cast<Eigen::Index>(free.size());
  Eigen::MatrixXd mass = Eigen::MatrixXd::Zero(3 * n, 3 * n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      mass.block<3, 3>(3 * i, 3 * j).diagonal().setConstant(kDensity * nodal(free[i], free[j]));
    }
  }
  return mass;
}

TEST(Eigenmodes, TheMassMatrixIntegratesQuadraticsExactly) {
  const TetMesh mesh = fixtures::box_mesh({2, 3, 1}, 2, 3, 2, 0.1);
  const TaylorHoodSpace space = make_space(mesh);
  const Eigen::SparseMatrix<double> mass = volume_mass(space);
  Eigen::VectorXd square(space.nodes);
  for (int i = 0; i < space.nodes; ++i) square[i] = std::pow(space.position(i).x(), 2);
  const Eigen::VectorXd one = Eigen::VectorXd::Ones(space.nodes);
  EXPECT_NEAR(one.dot(mass * one), 6.0, 1e-12);
  EXPECT_NEAR(one.dot(mass * square), 3.0 * 2.0 / 3.0, 1e-12);     // int x^2
  EXPECT_NEAR(square.dot(mass * square), 3.0 * 2.0 / 5.0, 1e-12);  // int x^4
}

// All of it by dense algebra, on a mesh whose symmetry makes pairs of equal frequencies.
TEST(Eigenmodes, AreThoseOfDenseAlgebraAndNoneIsMissing) {
  const TetMesh mesh = fixtures::box_mesh({3, 3, 1}, 3, 3, 2);
  const TaylorHoodSpace space = make_space(mesh);
  for (const double nu : {0.0, 0.3, 0.499}) {
    const ElasticMaterial material{kModulus, nu};
    const Eigenmodes modes = lowest_eigenmodes(space, material, kDensity, 40);
    const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> dense(dense_stiffness(space, material),
                                                                          dense_mass(space));
    for (int k = 0; k < 40; ++k) {
      const double wanted = std::sqrt(dense.eigenvalues()[k]);
      EXPECT_NEAR(modes.angular_frequency[k], wanted, 1e-8 * wanted) << nu << " " << k;
    }
  }
}

TEST(Eigenmodes, ModesAreOrthogonalInMassAndStiffness) {
  const TetMesh mesh = fixtures::box_mesh({3, 2, 1}, 3, 2, 2, 0.15);
  const TaylorHoodSpace space = make_space(mesh);
  const ElasticMaterial material{kModulus, 0.45};
  const Eigenmodes modes = lowest_eigenmodes(space, material, kDensity, 12);
  Eigen::MatrixXd free(0, 12);
  for (int node = 0; node < space.nodes; ++node) {
    const auto rows = modes.displacement.middleRows<3>(3 * node);
    if (space.clamped[node]) {
      EXPECT_EQ(rows.norm(), 0.0);
      continue;
    }
    free.conservativeResize(free.rows() + 3, 12);
    free.bottomRows<3>() = rows;
  }
  const Eigen::MatrixXd mass = free.transpose() * dense_mass(space) * free;
  EXPECT_LT((mass - Eigen::MatrixXd::Identity(12, 12)).cwiseAbs().maxCoeff(), 1e-8);
  const Eigen::VectorXd squares = modes.angular_frequency.cwiseAbs2();
  const Eigen::MatrixXd stiffness = free.transpose() * dense_stiffness(space, material) * free;
  EXPECT_LT((stiffness - Eigen::MatrixXd(squares.asDiagonal())).cwiseAbs().maxCoeff(), 1e-7 * squares[11]);
}

// At nu = 0 a block's motion along z alone is exact whatever its width: f = (2 k - 1) sqrt(E / rho) / (4 h).
TEST(Eigenmodes, ABlockWithoutPoissonsRatioHasTheThicknessModeOfALayer) {
  const TetMesh mesh = fixtures::box_mesh({4, 4, 5}, 3, 3, 5, 0.1);
  const TaylorHoodSpace space = make_space(mesh);
  const Eigenmodes modes = lowest_eigenmodes(space, {kModulus, 0.0}, kDensity, 12);
  const double wanted = std::sqrt(kModulus / kDensity) / 20.0;
  const double found =
      frequency_with_most(space, modes, [](const Eigen::Vector3d&) { return Eigen::Vector3d::UnitZ(); });
  EXPECT_NEAR(found, wanted, 1e-4 * wanted);
}

// A round column twists without change of volume or section, f = sqrt(G / rho) / (4 h), for every Poisson's ratio.
TEST(Eigenmodes, ARoundColumnTwistsAsItsShearModulusSays) {
  const TetMesh mesh = column_mesh(3.0, 5.0, 8, 4);
  const TaylorHoodSpace space = make_space(mesh);
  for (const double nu : {0.0, 0.3, 0.49, 0.5}) {
    const ElasticMaterial material{kModulus, nu};
    const Eigenmodes modes = lowest_eigenmodes(space, material, kDensity, 6);
    const double wanted = std::sqrt(shear_modulus(material) / kDensity) / 20.0;
    const double found = frequency_with_most(
        space, modes, [](const Eigen::Vector3d& x) { return Eigen::Vector3d::UnitZ().cross(x).eval(); });
    EXPECT_NEAR(found, wanted, 2e-3 * wanted) << nu;  // a polygon of 32 sides isn't quite round
  }
}

// Quadratic functions: an eigenvalue's error falls with the fourth power of the mesh.
TEST(Eigenmodes, FrequenciesConvergeWithTheFourthOrder) {
  std::vector<double> errors;
  const double wanted = 3.0 * std::sqrt(kModulus / kDensity) / 20.0;  // the second thickness mode at nu = 0
  for (const int cells : {2, 4}) {
    const TetMesh mesh = fixtures::box_mesh({1, 1, 5}, 1, 1, cells);
    const TaylorHoodSpace space = make_space(mesh);
    const Eigenmodes modes = lowest_eigenmodes(space, {kModulus, 0.0}, kDensity, 15);
    double nearest = std::numeric_limits<double>::infinity();
    for (const double omega : modes.angular_frequency) {
      nearest = std::min(nearest, std::abs(omega / (2.0 * kPi) / wanted - 1.0));
    }
    errors.push_back(nearest);
  }
  EXPECT_LT(errors[1], 2e-3);
  EXPECT_GT(errors[0] / errors[1], 10.0);
}

TEST(Eigenmodes, AnIncompressibleGelHasTheFrequenciesOfANearlyIncompressibleOne) {
  const TetMesh mesh = fixtures::box_mesh({4, 4, 2}, 4, 4, 2, 0.1);
  const TaylorHoodSpace space = make_space(mesh);
  const Eigenmodes limit = lowest_eigenmodes(space, {kModulus, 0.5}, kDensity, 10);
  const Eigenmodes near = lowest_eigenmodes(space, {kModulus, 0.4999}, kDensity, 10);
  for (int k = 0; k < 10; ++k) {
    EXPECT_NEAR(near.angular_frequency[k], limit.angular_frequency[k], 1e-3 * limit.angular_frequency[k]) << k;
  }
}

TEST(Eigenmodes, FrequenciesScaleWithModulusDensityAndLength) {
  const TetMesh mesh = fixtures::box_mesh({3, 2, 1}, 3, 2, 1);
  TetMesh large = mesh;
  for (Eigen::Vector3d& x : large.vertices) x *= 1000.0;
  const double one = lowest_eigenmodes(make_space(mesh), {kModulus, 0.4}, kDensity, 1).angular_frequency[0];
  const double other =
      lowest_eigenmodes(make_space(large), {16.0 * kModulus, 0.4}, 4.0 * kDensity, 1).angular_frequency[0];
  EXPECT_NEAR(other, one * 2.0 / 1000.0, 1e-9 * other);
}

TEST(Eigenmodes, AColumnOfTwoMaterialsSwingsAsTheWaveEquationSays) {
  // Along its axis at nu = 0: clamped below with modulus E1 to h1, E2 above with its end free, so
  // tan(k1 h1) tan(k2 h2) = sqrt(E1 / E2) with k = omega sqrt(rho / E).
  constexpr double kLower = 0.2, kUpper = 1.4, kLowerHeight = 2.0, kUpperHeight = 1.0;
  TetMesh mesh = fixtures::box_mesh({2.0, 2.0, kLowerHeight + kUpperHeight}, 2, 2, 6);
  for (const auto& tetrahedron : mesh.tetrahedra) {
    double middle = 0.0;
    for (const int v : tetrahedron) middle += mesh.vertices[v].z() / 4.0;
    mesh.region.push_back(middle > -kUpperHeight ? 1 : 0);
  }
  const std::vector<ElasticMaterial> materials = {{kLower, 0.0}, {kUpper, 0.0}};
  const auto excess = [&](double omega) {
    return std::tan(omega * std::sqrt(kDensity / kLower) * kLowerHeight) *
               std::tan(omega * std::sqrt(kDensity / kUpper) * kUpperHeight) -
           std::sqrt(kLower / kUpper);
  };
  double low = 0.0;
  double high = 0.5 * kPi / kLowerHeight * std::sqrt(kLower / kDensity) * (1.0 - 1e-9);  // the first pole
  for (int i = 0; i < 100; ++i) {
    const double middle = 0.5 * (low + high);
    (excess(middle) < 0.0 ? low : high) = middle;
  }
  const TaylorHoodSpace space = make_space(mesh, materials);
  const Eigenmodes modes = lowest_eigenmodes(space, materials, kDensity, 12);
  const double found =
      frequency_with_most(space, modes, [](const Eigen::Vector3d&) { return Eigen::Vector3d::UnitZ(); });
  EXPECT_NEAR(2.0 * kPi * found, low, 1e-3 * low);
  // The same from the outside: what contact sees, from one material where both are alike.
  const std::vector<ElasticMaterial> alike(2, ElasticMaterial{kLower, 0.0});
  const Eigen::VectorXd two = lowest_eigenmodes(make_space(mesh, alike), alike, kDensity, 4).angular_frequency;
  mesh.region.clear();
  const Eigen::VectorXd one = lowest_eigenmodes(make_space(mesh), alike[0], kDensity, 4).angular_frequency;
  EXPECT_LT((two - one).norm(), 1e-9 * one.norm());
}

TEST(Eigenmodes, WhatIsHeldDoesntMoveAndStiffens) {
  const TetMesh mesh = fixtures::box_mesh({4, 4, 2}, 4, 4, 2);
  const TaylorHoodSpace space = make_space(mesh);
  const ElasticMaterial material{kModulus, 0.5};
  const OuterSurface surface = outer_surface(mesh);
  std::vector<int> held;
  for (int v = 0; v < static_cast<int>(surface.mesh_vertex.size()); ++v) {
    if (mesh.vertices[surface.mesh_vertex[v]].norm() < 1.1) held.push_back(v);
  }
  ASSERT_GE(held.size(), 5u);
  const Eigenmodes free = lowest_eigenmodes(space, material, kDensity, 8);
  const Eigenmodes stuck = lowest_eigenmodes(space, material, kDensity, 8, held);
  const Eigen::SparseMatrix<double> coupling = surface_coupling(space, surface);
  for (int k = 0; k < 8; ++k) {
    EXPECT_GT(stuck.angular_frequency[k], free.angular_frequency[k]);
    for (int a = 0; a < 3; ++a) {
      const Eigen::VectorXd component = stuck.displacement.col(k)(Eigen::seqN(a, space.nodes, 3));
      const Eigen::VectorXd weighted = coupling * component;
      EXPECT_LT(weighted(held).norm(), 1e-9 * weighted.norm() + 1e-30);
    }
  }
}

TEST(Eigenmodes, TheSameInputGivesTheSameBytes) {
  const TetMesh mesh = fixtures::box_mesh({3, 3, 1}, 3, 3, 1);
  const TaylorHoodSpace space = make_space(mesh);
  EXPECT_EQ(lowest_eigenmodes(space, {kModulus, 0.49}, kDensity, 5).displacement,
            lowest_eigenmodes(space, {kModulus, 0.49}, kDensity, 5).displacement);
}

TEST(Eigenmodes, BadInputIsRefused) {
  const TetMesh mesh = fixtures::box_mesh({1, 1, 1}, 1, 1, 1);
  const TaylorHoodSpace space = make_space(mesh);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(lowest_eigenmodes(space, {kModulus, 0.51}, kDensity, 1), Error);
  EXPECT_THROW(lowest_eigenmodes(space, {kModulus, 0.4}, 0.0, 1), Error);
  EXPECT_THROW(lowest_eigenmodes(space, {kModulus, 0.4}, nan, 1), Error);
  EXPECT_THROW(lowest_eigenmodes(space, {kModulus, 0.4}, kDensity, 0), Error);
  EXPECT_THROW(lowest_eigenmodes(space, {kModulus, 0.4}, kDensity, 1000), Error);
}

}  // namespace
}  // namespace touchstone::fem
