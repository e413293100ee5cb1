// Bodies of several materials: the pressure jumps where they meet.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/error.h"
#include "fem/elements/compliance.h"
#include "fem/elements/elimination_order.h"
#include "fem/elements/taylor_hood.h"
#include "tests/fem/mesh/box_mesh.h"

namespace touchstone::fem {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using ::testing::HasSubstr;

/// An uneven box whose upper `layers` rows of cells are region 1, parted from the rest by a plane.
TetMesh two_layers(const Vector3d& size, int nx, int ny, int nz, int layers) {
  TetMesh mesh = fixtures::box_mesh(size, nx, ny, nz, 0.12);
  const int first = (nz - layers) * (nx + 1) * (ny + 1);
  const double plane = -size.z() * layers / nz;
  for (int v = first; v < first + (nx + 1) * (ny + 1); ++v) mesh.vertices[v].z() = plane;
  for (const auto& tetrahedron : mesh.tetrahedra) {
    double middle = 0.0;
    for (const int v : tetrahedron) middle += mesh.vertices[v].z() / 4.0;
    mesh.region.push_back(middle > plane ? 1 : 0);
  }
  return mesh;
}

Matrix3d stress_of(const ElasticMaterial& material, const Matrix3d& gradient) {
  return shear_modulus(material) *
         (gradient + gradient.transpose() + lame_ratio(material) * gradient.trace() * Matrix3d::Identity());
}

/// The gradient above a plane z = const if it is `below` under it: displacement and traction go on across it.
Matrix3d gradient_above(const ElasticMaterial& lower, const ElasticMaterial& upper, const Matrix3d& below) {
  const Vector3d wanted = stress_of(lower, below).col(2);
  const auto with = [&](const Vector3d& change) -> Matrix3d { return below + change * Vector3d::UnitZ().transpose(); };
  const Vector3d start = stress_of(upper, below).col(2);
  Matrix3d slope;
  for (int k = 0; k < 3; ++k) slope.col(k) = stress_of(upper, with(Vector3d::Unit(k))).col(2) - start;
  return with(slope.partialPivLu().solve(wanted - start));
}

struct Pair {
  ElasticMaterial lower, upper;
};

class TwoMaterials : public testing::TestWithParam<Pair> {};

TEST_P(TwoMaterials, PatchTestAcrossTheirInterface) {
  const ElasticMaterial lower = GetParam().lower;
  const ElasticMaterial upper = GetParam().upper;
  const TetMesh mesh = two_layers({3, 2, 1.5}, 3, 3, 3, 1);
  Matrix3d below;
  below << 0.010, -0.020, 0.005, 0.013, -0.004, 0.017, -0.008, 0.006, 0.011;
  const Matrix3d above = gradient_above(lower, upper, below);
  const auto exact = [&](const Vector3d& x) -> Vector3d {
    return below * x + std::max(0.0, x.z() + 0.5) * (above - below).col(2);
  };
  ElasticLoads loads;
  loads.bonded_displacement = exact;
  loads.traction = [&](const Vector3d& x, const Vector3d& normal) -> Vector3d {
    return (x.z() > -0.5 ? stress_of(upper, above) : stress_of(lower, below)) * normal;
  };
  const std::vector<ElasticMaterial> materials = {lower, upper};
  const TaylorHoodSpace space = make_space(mesh, materials);
  const ElasticSolution solution = solve_elastic(space, materials, loads);
  double error = 0.0;
  double largest = 0.0;
  for (int node = 0; node < space.nodes; ++node) {
    const Vector3d wanted = exact(space.position(node));
    error = std::max(error, (solution.displacement.row(node).transpose() - wanted).norm());
    largest = std::max(largest, wanted.norm());
  }
  EXPECT_LT(error, 1e-9 * largest);
  for (std::size_t e = 0; e < mesh.tetrahedra.size(); e += 7) {
    const bool up = mesh.region[e] == 1;
    const Matrix3d wanted = up ? stress_of(upper, above) : stress_of(lower, below);
    const Matrix3d found =
        stress_at(space, materials[mesh.region[e]], solution, static_cast<int>(e), Eigen::Vector4d(0.1, 0.2, 0.3, 0.4));
    EXPECT_LT((found - wanted).norm(), 1e-8 * wanted.norm()) << e;
  }
}

/// A column of layers under uniform pressure, its sides kept from moving out, and under uniform shear.
TEST_P(TwoMaterials, ABlockGivesTheSumOfItsLayers) {
  const ElasticMaterial lower = GetParam().lower;
  const ElasticMaterial upper = GetParam().upper;
  const TetMesh mesh = two_layers({3, 2, 1.5}, 3, 3, 3, 1);
  const std::vector<ElasticMaterial> materials = {lower, upper};
  const TaylorHoodSpace space = make_space(mesh, materials);
  const double load = 0.01;
  const auto modulus = [](const ElasticMaterial& m) { return shear_modulus(m) * (2.0 + lame_ratio(m)); };
  for (const int axis : {0, 2}) {
    ElasticLoads loads;
    loads.bonded_displacement = [](const Vector3d&) -> Vector3d { return Vector3d::Zero(); };
    loads.traction = [&](const Vector3d& x, const Vector3d& normal) -> Vector3d {
      const ElasticMaterial& here = x.z() > -0.5 ? upper : lower;
      Matrix3d stress = Matrix3d::Zero();
      if (axis == 2) {
        stress(2, 2) = -load;
        stress(0, 0) = stress(1, 1) = -load * lame_ratio(here) / (2.0 + lame_ratio(here));
      } else {
        stress(0, 2) = stress(2, 0) = load;
      }
      return stress * normal;
    };
    const ElasticSolution solution = solve_elastic(space, materials, loads);
    const double wanted = axis == 2 ? -load * (0.5 / modulus(upper) + 1.0 / modulus(lower))
                                    : load * (0.5 / shear_modulus(upper) + 1.0 / shear_modulus(lower));
    for (int node = 0; node < space.nodes; ++node) {
      if (space.position(node).z() < -1e-12) continue;
      EXPECT_NEAR(solution.displacement(node, axis), wanted, 1e-9 * std::abs(wanted)) << axis;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Materials, TwoMaterials,
                         testing::Values(Pair{{0.33, 0.3}, {2.0, 0.45}}, Pair{{0.33, 0.49}, {0.1, 0.0}},
                                         Pair{{0.33, 0.4999}, {3000.0, 0.3}}, Pair{{50.0, 0.2}, {0.05, 0.49}}));

TEST(MaterialRegions, LayersThatAreAlikeAreOneBody) {
  TetMesh mesh = two_layers({3, 2, 1.5}, 4, 3, 3, 1);
  const ElasticMaterial material{0.33, 0.49};
  const std::vector<ElasticMaterial> twice = {material, material};
  const std::vector<Bead> bead = {{{0.1, 0.1, -0.6}, 0.2}};
  const Compliance layered = compute_compliance(mesh, twice, bead, 1.5);
  mesh.region.clear();
  const Compliance plain = compute_compliance(mesh, material, bead, 1.5);
  EXPECT_EQ(layered.report.unknowns, plain.report.unknowns);
  EXPECT_TRUE(layered.surface.view() == plain.surface.view());
  EXPECT_TRUE(layered.beads.view() == plain.beads.view());
}

TEST(MaterialRegions, APressureThatMayJumpWhereItNeedNotChangesLittle) {
  // Between all but equal materials the spaces differ, the answers only by the mesh's error.
  TetMesh mesh = two_layers({3, 3, 1}, 8, 8, 4, 2);
  const std::vector<ElasticMaterial> nearly = {{0.33, 0.49}, {0.33 * (1.0 + 1e-9), 0.49}};
  const Compliance layered = compute_compliance(mesh, nearly, {}, 1.0);
  const Compliance plain = compute_compliance(mesh, nearly[0], {}, 1.0);
  EXPECT_GT(layered.report.unknowns, plain.report.unknowns);
  EXPECT_LT((layered.surface.view() - plain.surface.view()).norm(), 0.02 * plain.surface.view().norm());
}

TEST(MaterialRegions, TheOrderOfEliminationHoldsEachUnknownOnce) {
  const TetMesh mesh = two_layers({3, 2, 1}, 5, 4, 3, 1);
  const TaylorHoodSpace space = make_space(mesh);
  EXPECT_EQ(space.pressure.size(), space.pressure_vertex.size());
  EXPECT_EQ(static_cast<int>(space.pressure.size()), space.vertices + 6 * 5);  // the interface's vertices twice
  std::vector<int> order = elimination_order(space);
  std::sort(order.begin(), order.end());
  std::vector<int> all(space.unknowns);
  std::iota(all.begin(), all.end(), 0);
  EXPECT_EQ(order, all);
}

TEST(MaterialRegions, ScalingAllModuliScalesTheCompliance) {
  const TetMesh mesh = two_layers({3, 2, 1}, 4, 3, 3, 1);
  const std::vector<ElasticMaterial> soft = {{0.33, 0.49}, {2.0, 0.3}};
  const std::vector<ElasticMaterial> hard = {{0.33e5, 0.49}, {2.0e5, 0.3}};
  const Compliance a = compute_compliance(mesh, soft, {}, 1.0);
  const Compliance b = compute_compliance(mesh, hard, {}, 1.0);
  EXPECT_LT((a.surface.view() - 1e5 * b.surface.view()).norm(), 1e-11 * a.surface.view().norm());
}

TEST(MaterialRegions, TooFewMaterialsAndBadRegionsAreRefused) {
  TetMesh mesh = two_layers({3, 2, 1}, 2, 2, 2, 1);
  const std::vector<ElasticMaterial> one = {{0.33, 0.49}};
  try {
    compute_compliance(mesh, one, {}, 1.0);
    FAIL() << "not refused";
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "the gel's mesh has 2 regions, but 1 materials are given");
  }
  mesh.region[3] = -1;
  EXPECT_EQ(fault_of(mesh), "tetrahedron 3 is of region -1; regions count from 0");
  mesh.region.pop_back();
  EXPECT_THAT(fault_of(mesh), HasSubstr("regions"));
}

}  // namespace
}  // namespace touchstone::fem
