#include "fem/elements/compliance.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "core/error.h"
#include "fem/elements/surface_coupling.h"
#include "fem/elements/taylor_hood.h"
#include "fem/mesh/slab.h"
#include "tests/fem/elements/gaussian_work.h"
#include "tests/fem/fine_relief/layer_kernel.h"
#include "tests/fem/mesh/box_mesh.h"

namespace touchstone::fem {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

const ElasticMaterial kSoft{0.33, 0.49};

TetMesh small_mesh() {
  return fixtures::box_mesh({3, 2, 1}, 4, 3, 2, 0.12);
}
std::vector<Bead> two_beads() {
  return {{{0.2, -0.1, -0.4}, 0.25}, {{-0.9, 0.5, -0.6}, 0.2}};
}

double relative_difference(const MatrixXd& a, const MatrixXd& b) {
  return (a - b).cwiseAbs().maxCoeff() / b.cwiseAbs().maxCoeff();
}

/// The mesh with each vertex moved by `move`; a mirror turns the tetrahedra and triangles round.
TetMesh moved(const TetMesh& mesh, const Matrix3d& move) {
  TetMesh result = mesh;
  for (Vector3d& vertex : result.vertices) {
    vertex = move * vertex;
  }
  if (move.determinant() < 0.0) {
    for (auto& tetrahedron : result.tetrahedra) {
      std::swap(tetrahedron[0], tetrahedron[1]);
    }
    for (auto* faces : {&result.outer, &result.bonded}) {
      for (auto& face : *faces) {
        std::swap(face[0], face[1]);
      }
    }
  }
  return result;
}

TEST(Compliance, IsSymmetricPositiveDefinite) {
  for (const double nu : {0.0, 0.3, 0.49, 0.5}) {
    const Compliance gel = compute_compliance(small_mesh(), {0.33, nu}, two_beads(), 1.0);
    EXPECT_TRUE(gel.surface.view() == gel.surface.view().transpose());
    EXPECT_EQ(Eigen::LLT<MatrixXd>(gel.surface.view()).info(), Eigen::Success) << nu;
  }
}

TEST(Compliance, ItsEliminationIsCountedBeforehand) {
  const ElasticMaterial material = kSoft;
  const std::vector<Bead> beads = two_beads();
  const Compliance gel = compute_compliance(small_mesh(), material, beads, 1.0);
  const EliminationCount count = count_elimination(small_mesh(), std::span(&material, 1), beads);
  EXPECT_EQ(count.unknowns, gel.report.unknowns);
  EXPECT_EQ(count.border, 3.0 * static_cast<double>(gel.vertices.size() + beads.size()));
  EXPECT_EQ(count.operations, gel.report.operations);
  const double inside = count_factorisation(small_mesh(), std::span(&material, 1));
  EXPECT_GT(inside, 0.0);
  EXPECT_LT(inside, count.operations);
}

TEST(Compliance, SchurComplementEqualsASolveOfTheLoad) {
  const TetMesh mesh = small_mesh();
  const TaylorHoodSpace space = make_space(mesh);
  const auto pull = [](const Vector3d& x) -> Vector3d {
    return {0.01 + 0.02 * x.y(), -0.03 * x.x(), 0.02 - 0.01 * x.x()};
  };
  ElasticLoads loads;
  loads.traction = [&](const Vector3d& x, const Vector3d&) -> Vector3d {
    return x.z() == 0.0 ? pull(x) : Vector3d::Zero();
  };
  for (const double nu : {0.0, 0.3, 0.49, 0.5}) {
    const Compliance gel = compute_compliance(mesh, {0.33, nu}, two_beads(), 1.0);
    const ElasticSolution solution = solve_elastic(space, {0.33, nu}, loads);
    VectorXd traction(3 * static_cast<Eigen::Index>(gel.vertices.size()));
    for (std::size_t i = 0; i < gel.vertices.size(); ++i) {
      traction.segment<3>(3 * static_cast<Eigen::Index>(i)) = pull(gel.vertices[i]);
    }
    // Row-wise 3 components, as the degrees of freedom run.
    const MatrixXd surface = (surface_coupling(space, outer_surface(mesh)) * solution.displacement).transpose();
    const MatrixXd beads = (bead_means(space, two_beads()) * solution.displacement).transpose();
    EXPECT_LT(relative_difference(gel.surface.view() * traction, surface.reshaped()), 1e-9) << nu;
    EXPECT_LT(relative_difference(gel.beads.view() * traction, beads.reshaped()), 1e-9) << nu;
  }
}

TEST(Compliance, TurnsAndMirrorsWithTheGel) {
  const TetMesh mesh = small_mesh();
  const Compliance gel = compute_compliance(mesh, kSoft, two_beads(), 1.0);
  const Matrix3d turn = Eigen::AngleAxisd(0.7, Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  const Matrix3d mirror = Vector3d(-1, 1, 1).asDiagonal();
  for (const Matrix3d& move : {turn, mirror, Matrix3d(turn * mirror)}) {
    std::vector<Bead> beads = two_beads();
    for (Bead& bead : beads) {
      bead.centre = move * bead.centre;
    }
    const Compliance other = compute_compliance(moved(mesh, move), kSoft, beads, 1.0);
    const auto n = static_cast<Eigen::Index>(gel.vertices.size());
    MatrixXd expected(3 * n, 3 * n);
    for (Eigen::Index i = 0; i < n; ++i) {
      for (Eigen::Index j = 0; j < n; ++j) {
        expected.block<3, 3>(3 * i, 3 * j) = move * gel.surface.view().block<3, 3>(3 * i, 3 * j) * move.transpose();
      }
    }
    EXPECT_LT(relative_difference(other.surface.view(), expected), 1e-10);
    for (Eigen::Index j = 0; j < n; ++j) {
      for (Eigen::Index b = 0; b < 2; ++b) {
        // The sphere's quadrature points stay with the axes, the elements turn: equal to the rule's error.
        EXPECT_LT((other.beads.view().block<3, 3>(3 * b, 3 * j) -
                   move * gel.beads.view().block<3, 3>(3 * b, 3 * j) * move.transpose())
                      .cwiseAbs()
                      .maxCoeff(),
                  1e-3 * gel.beads.view().cwiseAbs().maxCoeff());
      }
    }
  }
}

TEST(Compliance, DoesntDependOnTheOrderOfVerticesAndTetrahedra) {
  const TetMesh mesh = small_mesh();
  const int count = static_cast<int>(mesh.vertices.size());
  std::vector<int> place(count);  // a permutation: 17 and the count have no common factor
  ASSERT_EQ(std::gcd(17, count), 1);
  TetMesh shuffled = mesh;
  for (int i = 0; i < count; ++i) {
    place[i] = (17 * i + 5) % count;
    shuffled.vertices[place[i]] = mesh.vertices[i];
  }
  for (auto& tetrahedron : shuffled.tetrahedra) {
    for (int& vertex : tetrahedron) {
      vertex = place[vertex];
    }
  }
  std::reverse(shuffled.tetrahedra.begin(), shuffled.tetrahedra.end());
  for (auto* faces : {&shuffled.outer, &shuffled.bonded}) {
    for (auto& face : *faces) {
      for (int& vertex : face) {
        vertex = place[vertex];
      }
    }
  }
  const Compliance gel = compute_compliance(mesh, kSoft, two_beads(), 1.0);
  const Compliance other = compute_compliance(shuffled, kSoft, two_beads(), 1.0);
  const std::size_t n = gel.vertices.size();
  std::vector<Eigen::Index> same(n);
  for (std::size_t i = 0; i < n; ++i) {
    const auto found = std::find(other.vertices.begin(), other.vertices.end(), gel.vertices[i]);
    ASSERT_NE(found, other.vertices.end());
    same[i] = found - other.vertices.begin();
  }
  const double size = gel.surface.view().cwiseAbs().maxCoeff();
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) {
      const Matrix3d difference =
          other.surface.view().block<3, 3>(3 * same[i], 3 * same[j]) -
          gel.surface.view().block<3, 3>(3 * static_cast<Eigen::Index>(i), 3 * static_cast<Eigen::Index>(j));
      EXPECT_LT(difference.cwiseAbs().maxCoeff(), 1e-11 * size);
    }
  }
}

TEST(Compliance, UnitsDontMatter) {
  const Compliance in_mm = compute_compliance(small_mesh(), kSoft, two_beads(), 1.0);
  for (const auto& [length, stress] : {std::pair{1e-3, 1e6}, std::pair{1e-6, 1.0}, std::pair{1.0, 1e-6}}) {
    std::vector<Bead> beads = two_beads();
    for (Bead& bead : beads) {
      bead.centre *= length;
      bead.radius *= length;
    }
    const Compliance other = compute_compliance(moved(small_mesh(), length * Matrix3d::Identity()),
                                                {kSoft.youngs_modulus * stress, kSoft.poisson_ratio}, beads, length);
    EXPECT_LT(relative_difference(other.surface.view() * (stress / std::pow(length, 3)), in_mm.surface.view()), 1e-11);
    EXPECT_LT(relative_difference(other.beads.view() * (stress / length), in_mm.beads.view()), 1e-11);
    EXPECT_LT(relative_difference(MatrixXd(other.mass) / (length * length), MatrixXd(in_mm.mass)), 1e-12);
  }
}

/// In the middle of a wide pad its sides are out of reach: a column under confined compression, and simple shear.
TEST(Compliance, WidePadIsConfinedUnderPressureAndSheared) {
  const TetMesh mesh = fixtures::box_mesh({20, 20, 1}, 20, 20, 2);
  const std::vector<Bead> beads = {{{0.1, -0.05, -0.4}, 0.25}};
  const ElasticMaterial material{0.33, 0.3};
  const Compliance gel = compute_compliance(mesh, material, beads, 1.0);
  const auto n = static_cast<Eigen::Index>(gel.vertices.size());
  const double shear = shear_modulus(material);
  const double confined = shear * (2.0 + lame_ratio(material));
  VectorXd pressure = VectorXd::Zero(3 * n);
  VectorXd drag = VectorXd::Zero(3 * n);
  for (Eigen::Index i = 0; i < n; ++i) {
    pressure[3 * i + 2] = -0.01;
    drag[3 * i] = 0.01;
  }
  const Eigen::Vector3d sunk = gel.beads.view() * pressure;
  EXPECT_NEAR(sunk.z(), -0.01 / confined * 0.6, 1e-3 * 0.01 / confined);
  EXPECT_NEAR(sunk.x(), 0.0, 1e-3 * 0.01 / confined);
  const Eigen::Vector3d dragged = gel.beads.view() * drag;
  EXPECT_NEAR(dragged.x(), 0.01 / shear * 0.6, 1e-3 * 0.01 / shear);
  const VectorXd surface = gel.surface.view() * pressure;
  const VectorXd weights = gel.mass * VectorXd::Ones(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    if (gel.vertices[static_cast<std::size_t>(i)].norm() < 1.0) {
      EXPECT_NEAR(surface[3 * i + 2] / weights[i], -0.01 / confined, 1e-3 * 0.01 / confined);
    }
  }
}

TEST(Compliance, AgreesWithTheLayerKernel) {
  SlabMesh slab;
  slab.size_x = slab.size_y = 16.0;  // half-width of 4 thicknesses
  slab.thickness = 2.0;
  slab.fine = 0.6;
  slab.coarse = 2.0;
  slab.fine_half_x = slab.fine_half_y = 3.0;
  slab.fine_depth = 1.0;
  const TetMesh mesh = mesh_slab(slab);
  for (const double nu : {0.0, 0.3, 0.49}) {
    const ElasticMaterial material{0.33, nu};
    const Compliance gel = compute_compliance(mesh, material, {}, slab.thickness);
    const double exact = fixtures::gaussian_pressure_work(material, slab.thickness, 1.2);
    EXPECT_NEAR(fixtures::gaussian_work(gel, 1.2) / exact, 1.0, 0.01) << nu;
  }
}

TEST(Compliance, SameInputGivesTheSameBytes) {
  const Compliance first = compute_compliance(small_mesh(), kSoft, two_beads(), 1.0);
  const Compliance second = compute_compliance(small_mesh(), kSoft, two_beads(), 1.0);
  EXPECT_TRUE(first.surface.view() == second.surface.view());
  EXPECT_TRUE(first.beads.view() == second.beads.view());
}

TEST(Compliance, NeedsNoBeads) {
  const Compliance gel = compute_compliance(small_mesh(), kSoft, {}, 1.0);
  EXPECT_EQ(gel.beads.rows(), 0);
  EXPECT_EQ(gel.beads.cols(), gel.surface.rows());
}

TEST(Compliance, ReportsItsMesh) {
  const TetMesh mesh = small_mesh();
  const Compliance gel = compute_compliance(mesh, kSoft, {}, 1.0);
  EXPECT_EQ(gel.report.tetrahedra, 144);
  EXPECT_EQ(gel.report.unknowns, make_space(mesh).unknowns);
  EXPECT_NEAR(gel.report.smallest_dihedral_deg, smallest_dihedral_angle(mesh) * 57.29577951308232, 1e-9);
  EXPECT_EQ(gel.vertices.size(), 20u);
}

TEST(Compliance, BadInputIsRefused) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(compute_compliance(small_mesh(), {0.33, 0.6}, {}, 1.0), Error);
  EXPECT_THROW(compute_compliance(small_mesh(), {nan, 0.3}, {}, 1.0), Error);
  EXPECT_THROW(compute_compliance(small_mesh(), kSoft, {}, 0.0), Error);
  EXPECT_THROW(compute_compliance(small_mesh(), kSoft, {}, nan), Error);
  EXPECT_THROW(compute_compliance(TetMesh(), kSoft, {}, 1.0), Error);
  EXPECT_THROW(compute_compliance(small_mesh(), kSoft, std::vector<Bead>{{{0, 0, 0}, 0.25}}, 1.0), Error);
  TetMesh free_floating = small_mesh();
  free_floating.bonded.clear();
  EXPECT_THROW(compute_compliance(free_floating, kSoft, {}, 1.0), Error);
  EXPECT_THROW(with_modulus(Compliance(), 0.0), Error);
  EXPECT_THROW(with_modulus(Compliance(), nan), Error);
}

}  // namespace
}  // namespace touchstone::fem
