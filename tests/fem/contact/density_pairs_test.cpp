#include "fem/contact/density_pairs.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <utility>

#include "fem/elements/elastic_material.h"

namespace touchstone::fem {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Cells of a triangle's split into 16, each with the hats' values in its middle; `factor`: of a slope of the
/// density over the first corner's hat.
std::vector<DensityCell> cells_of(const std::array<Vector3d, 3>& corners, double factor) {
  std::vector<DensityCell> cells;
  const double area = 0.5 * (corners[1] - corners[0]).cross(corners[2] - corners[0]).norm() / 16.0;
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; i + j < 4; ++j) {
      for (int upside = 0; upside < (i + j < 3 ? 2 : 1); ++upside) {
        DensityCell cell;
        const double shift = upside ? 2.0 / 3.0 : 1.0 / 3.0;
        cell.corners = Vector3d(i + shift, j + shift, 4.0 - i - j - 2.0 * shift) / 4.0;
        cell.at = cell.corners[0] * corners[0] + cell.corners[1] * corners[1] + cell.corners[2] * corners[2];
        cell.area = area;
        cell.density = area * (cell.corners.array() * (1.0 + factor * cell.corners[0])).matrix();
        cells.push_back(cell);
      }
    }
  }
  return cells;
}

DensityTriangle triangle_at(const Vector3d& from, double factor, int place, bool plain) {
  const std::array<Vector3d, 3> corners{from, from + Vector3d(1.0, 0.0, 0.05), from + Vector3d(0.4, 0.9, -0.03)};
  DensityTriangle triangle(cells_of(corners, plain ? 0.0 : factor), cells_of(corners, 0.0));
  triangle.is_cut = true;
  triangle.first = Vector3d(0.8, 0.6, 0.0);
  triangle.second = Vector3d(-0.6, 0.8, 0.0);
  triangle.place = {place, place + 1, place + 2};
  return triangle;
}

// The sum over all pairs of cells of Boussinesq's and Cerruti's point responses, plain loops.
Matrix3d summed(const HalfSpaceResponse& half_space, const DensityTriangle& a, int i, const DensityTriangle& b, int j) {
  constexpr double kSpread = 0.0962;
  const CellColumns& in_a = a.now.cells;
  const CellColumns& in_b = b.now.cells;
  Matrix3d sum = Matrix3d::Zero();
  for (int k = 0; k < in_a.size(); ++k) {
    for (int l = 0; l < in_b.size(); ++l) {
      const Vector3d from = (in_a.at.row(k) - in_b.at.row(l)).matrix().transpose();
      const double x = a.first.dot(from);
      const double y = a.second.dot(from);
      const double r2 = from.squaredNorm();
      const double mass = in_a.density(k, i) * in_b.density(l, j);
      // A point's, with 1/r of the mean over both cells: the normal part is as 1/r, the rest nearly so.
      const double wider = 1.0 + 0.5 * kSpread * (in_a.area[k] + in_b.area[l]) / r2;
      sum += mass * wider * half_space.between(x, y, r2);
    }
  }
  return sum;
}

TEST(DensityPairs, AreTheSumOfPointResponses) {
  const HalfSpaceResponse half_space({.youngs_modulus = 0.2, .poisson_ratio = 0.35}, 100.0, 1.0);
  const DensityTriangle a = triangle_at(Vector3d::Zero(), 0.7, 0, false);
  const DensityTriangle b = triangle_at(Vector3d(1.1, 0.8, 0.1), -0.3, 3, false);
  DensityPairs adding(half_space, 6, false);
  adding.add(a, b, true);
  const DensityPairs::Responses pairs = adding.take();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const Matrix3d found = pairs.cut.block<3, 3>(3 * i, 3 * (3 + j));
      const Matrix3d expected = summed(half_space, a, i, b, j);
      EXPECT_NEAR(found(0, 0), expected(0, 0), 1e-12 * std::abs(expected(0, 0)));
      EXPECT_LT((found - expected).norm(), 2e-3 * expected.norm()) << found << "\n\n" << expected;
    }
  }
  EXPECT_EQ(pairs.cut, Eigen::MatrixXd(pairs.cut.transpose())) << "Betti's reciprocity";
}

// Whatever their order: the response of one density's centre to the other's mass, and its transpose.
TEST(DensityPairs, FarOnesActBetweenTheirCentres) {
  const HalfSpaceResponse half_space({.youngs_modulus = 0.2, .poisson_ratio = 0.35}, 100.0, 1.0);
  const std::array<DensityTriangle, 3> triangles{triangle_at(Vector3d::Zero(), 0.7, 0, false),
                                                 triangle_at(Vector3d(5.0, 1.0, 0.2), -0.3, 3, false),
                                                 triangle_at(Vector3d(-4.0, 6.0, 0.0), 0.5, 6, false)};
  DensityPairs adding(half_space, 9, false);
  const std::array<std::pair<int, int>, 4> order{{{0, 1}, {2, 1}, {0, 2}, {0, 1}}};
  for (const auto& [a, b] : order) adding.add(triangles[a], triangles[b], false);
  const DensityPairs::Responses pairs = adding.take();
  Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(27, 27);
  for (const auto& [a, b] : order) {
    const TriangleDensity& one = triangles[a].now;
    const TriangleDensity& other = triangles[b].now;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        const Vector3d from = one.centre[i] - other.centre[j];
        const Matrix3d block =
            one.mass[i] * other.mass[j] *
            half_space.between(triangles[a].first.dot(from), triangles[a].second.dot(from), from.squaredNorm());
        const int row = 3 * triangles[a].place[i];
        const int column = 3 * triangles[b].place[j];
        expected.block<3, 3>(row, column) += block;
        expected.block<3, 3>(column, row) += block.transpose();
      }
    }
  }
  EXPECT_LT((pairs.cut - expected).cwiseAbs().maxCoeff(), 1e-14 * expected.cwiseAbs().maxCoeff());
}

TEST(DensityPairs, NormalRowsAloneAreThoseOfAll) {
  const HalfSpaceResponse half_space({.youngs_modulus = 0.2, .poisson_ratio = 0.45}, 2.0, 0.9);  // fades
  ASSERT_GT(half_space.fade, 0.0);
  const DensityTriangle a = triangle_at(Vector3d::Zero(), 0.7, 0, false);
  const DensityTriangle b = triangle_at(Vector3d(1.1, 0.8, 0.1), -0.3, 3, false);
  const DensityTriangle c = triangle_at(Vector3d(9.0, -2.0, 0.0), 0.4, 6, false);
  DensityPairs::Responses found[2];
  for (const bool normal_only : {false, true}) {
    DensityPairs pairs(half_space, 9, normal_only);
    pairs.add(a, a, true);
    pairs.add(a, b, true);
    pairs.add(b, b, true);
    pairs.add(a, c, false);
    pairs.add(b, c, false);
    found[normal_only] = pairs.take();
  }
  const auto& [all, normal] = found;
  for (int i = 0; i < 9; ++i) {
    for (int j = 0; j < 9; ++j) {
      EXPECT_NEAR(normal.cut(i, j), all.cut(3 * i, 3 * j), 1e-14 * all.cut(0, 0));
      EXPECT_NEAR(normal.whole(i, j), all.whole(3 * i, 3 * j), 1e-14 * all.whole(0, 0));
    }
  }
}

TEST(DensityPairs, WhatIsNotCutDiffersNot) {
  const HalfSpaceResponse half_space({.youngs_modulus = 0.2, .poisson_ratio = 0.5}, 100.0, 1.0);
  const DensityTriangle a = triangle_at(Vector3d::Zero(), 0.0, 0, true);
  const DensityTriangle b = triangle_at(Vector3d(1.1, 0.8, 0.1), 0.0, 3, true);
  ASSERT_TRUE(a.same_cells);
  DensityPairs adding(half_space, 6, false);
  adding.add(a, a, true);
  adding.add(a, b, true);
  adding.add(b, a, false);
  const DensityPairs::Responses pairs = adding.take();
  EXPECT_EQ(pairs.cut, pairs.whole);
}

}  // namespace
}  // namespace touchstone::fem
