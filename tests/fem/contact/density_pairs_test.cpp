#include "fem/contact/density_pairs.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

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

/// Triangles of edge 1, equilateral but for a bend out of the plane, in a hexagon of three rings. Where x > `edge_at`
/// hats bear nothing, and what is left of one is scaled up to its mass.
struct Lattice {
  std::vector<DensityVertex> vertices;
  std::vector<DensityTriangle> triangles;
};

Vector3d lattice_point(int i, int j) {
  const double x = i + 0.5 * j;
  const double y = std::sqrt(0.75) * j;
  return {x, y, 0.02 * x * x};
}

Lattice lattice_cut_at(double edge_at) {
  constexpr int kRings = 3;
  Lattice lattice;
  std::map<std::pair<int, int>, int> place;
  for (int i = -kRings; i <= kRings; ++i) {
    for (int j = -kRings; j <= kRings; ++j) {
      if (std::abs(i + j) > kRings) continue;
      place[{i, j}] = static_cast<int>(lattice.vertices.size());
      lattice.vertices.push_back({lattice_point(i, j), Vector3d(0.8, 0.6, 0.0), Vector3d(-0.6, 0.8, 0.0), false});
    }
  }
  struct Made {
    std::array<int, 3> place;
    Vector3d middle;
    std::vector<DensityCell> whole, cut;
  };
  std::vector<Made> made;
  Eigen::VectorXd mass = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(place.size()));
  Eigen::VectorXd left = mass;
  const auto add = [&](const std::array<std::pair<int, int>, 3>& corner) {
    Made triangle;
    std::array<Vector3d, 3> at;
    for (int k = 0; k < 3; ++k) {
      const auto found = place.find(corner[k]);
      triangle.place[k] = found == place.end() ? -1 : found->second;
      at[k] = lattice_point(corner[k].first, corner[k].second);
    }
    triangle.middle = (at[0] + at[1] + at[2]) / 3.0;
    triangle.whole = triangle.cut = cells_of(at, 0.0);
    for (DensityCell& cell : triangle.cut) {
      const bool bears = cell.at.x() <= edge_at;
      for (int k = 0; k < 3; ++k) {
        if (triangle.place[k] >= 0) mass[triangle.place[k]] += cell.density[k];
        if (triangle.place[k] >= 0 && bears) left[triangle.place[k]] += cell.density[k];
      }
      if (!bears) cell.density.setZero();
    }
    made.push_back(triangle);
  };
  for (int i = -kRings - 1; i <= kRings; ++i) {
    for (int j = -kRings - 1; j <= kRings; ++j) {
      add({{{i, j}, {i + 1, j}, {i, j + 1}}});
      add({{{i + 1, j}, {i + 1, j + 1}, {i, j + 1}}});
    }
  }
  for (std::size_t k = 0; k < lattice.vertices.size(); ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    lattice.vertices[k].is_cut = left[at] < mass[at];
  }
  for (Made& triangle : made) {
    for (DensityCell& cell : triangle.cut) {
      for (int k = 0; k < 3; ++k) {
        if (triangle.place[k] >= 0 && left[triangle.place[k]] > 0.0) {
          cell.density[k] *= mass[triangle.place[k]] / left[triangle.place[k]];
        }
      }
    }
    DensityTriangle& part = lattice.triangles.emplace_back(triangle.cut, triangle.whole);
    part.middle = triangle.middle;
    part.first = Vector3d(0.8, 0.6, 0.0);
    part.second = Vector3d(-0.6, 0.8, 0.0);
    part.place = triangle.place;
  }
  return lattice;
}

DensityTriangle triangle_at(const Vector3d& from, double factor, int place, bool plain) {
  const std::array<Vector3d, 3> corners{from, from + Vector3d(1.0, 0.0, 0.05), from + Vector3d(0.4, 0.9, -0.03)};
  DensityTriangle triangle(cells_of(corners, plain ? 0.0 : factor), cells_of(corners, 0.0));
  triangle.middle = from;
  triangle.first = Vector3d(0.8, 0.6, 0.0);
  triangle.second = Vector3d(-0.6, 0.8, 0.0);
  triangle.place = {place, place + 1, place + 2};
  return triangle;
}

// The sum over all pairs of cells of Boussinesq's and Cerruti's point responses, plain loops.
Matrix3d summed(const HalfSpaceResponse& half_space, const DensityTriangle& a, const TriangleDensity& of_a, int i,
                const TriangleDensity& of_b, int j) {
  constexpr double kSpread = 0.0962;
  const CellColumns& in_a = of_a.cells;
  const CellColumns& in_b = of_b.cells;
  Matrix3d sum = Matrix3d::Zero();
  for (int k = 0; k < in_a.size(); ++k) {
    for (int l = 0; l < in_b.size(); ++l) {
      const Vector3d from = (in_a.at.row(k) - in_b.at.row(l)).matrix().transpose();
      const double x = a.first.dot(from);
      const double y = a.second.dot(from);
      const double r2 = from.squaredNorm();
      const double mass = in_a.density(k, i) * in_b.density(l, j);
      if (mass == 0.0) continue;
      // A point's, with 1/r of the mean over both cells: the normal part is as 1/r, the rest nearly so.
      const double wider = 1.0 + 0.5 * kSpread * (in_a.area[k] + in_b.area[l]) / r2;
      sum += mass * wider * half_space.between(x, y, r2);
    }
  }
  return sum;
}

/// Two triangles with no common corner, whose hats all are cut.
std::vector<DensityVertex> vertices_of(const std::vector<DensityTriangle>& triangles) {
  std::vector<DensityVertex> result;
  for (const DensityTriangle& triangle : triangles) {
    for (int k = 0; k < 3; ++k) result.push_back({triangle.middle, triangle.first, triangle.second, true});
  }
  return result;
}

TEST(DensityPairs, AreTheSumOfPointResponses) {
  const HalfSpaceResponse half_space({.youngs_modulus = 0.2, .poisson_ratio = 0.35}, 100.0, 1.0);
  const std::vector<DensityTriangle> triangles{triangle_at(Vector3d::Zero(), 0.7, 0, false),
                                               triangle_at(Vector3d(1.1, 0.8, 0.1), -0.3, 3, false)};
  const DensityResponses pairs = density_responses(half_space, vertices_of(triangles), triangles, 1.0, false);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const Matrix3d found = pairs.cut.block<3, 3>(3 * i, 3 * (3 + j));
      const Matrix3d expected = summed(half_space, triangles[0], triangles[0].now, i, triangles[1].now, j);
      EXPECT_NEAR(found(0, 0), expected(0, 0), 1e-12 * std::abs(expected(0, 0)));
      EXPECT_LT((found - expected).norm(), 2e-3 * expected.norm()) << found << "\n\n" << expected;
    }
  }
  EXPECT_EQ(pairs.cut, Eigen::MatrixXd(pairs.cut.transpose())) << "Betti's reciprocity";
}

// Hats that an outline cuts at any place among them: what vertices do to others, from the next but one to those at the
// other end of the contact, against the sum over all their cells: 1.1 % at most where triangles' centres stand for
// them, 0.7 % by moments.
TEST(DensityPairs, FarOnesActAsTheSumOverTheirCells) {
  const HalfSpaceResponse half_space({.youngs_modulus = 0.2, .poisson_ratio = 0.35}, 100.0, 1.0);
  for (const double edge_at : {0.1, 0.55}) {
    const Lattice lattice = lattice_cut_at(edge_at);
    const DensityResponses pairs = density_responses(half_space, lattice.vertices, lattice.triangles, 1.0, false);
    const auto n = static_cast<Eigen::Index>(lattice.vertices.size());
    for (const bool cut : {true, false}) {
      Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(3 * n, 3 * n);
      for (const DensityTriangle& a : lattice.triangles) {
        for (const DensityTriangle& b : lattice.triangles) {
          for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) {
              const int row = a.place[i], column = b.place[j];
              if (row < 0 || column < 0) continue;
              if (!lattice.vertices[row].is_cut && !lattice.vertices[column].is_cut) continue;
              if ((lattice.vertices[row].at - lattice.vertices[column].at).norm() < 1.2) continue;
              expected.block<3, 3>(3 * row, 3 * column) +=
                  summed(half_space, a, cut ? a.now : a.whole, i, cut ? b.now : b.whole, j);
            }
          }
        }
      }
      for (Eigen::Index k = 0; k < n; ++k) {
        for (Eigen::Index l = 0; l < n; ++l) {
          const Matrix3d wanted = expected.block<3, 3>(3 * k, 3 * l);
          if (wanted.isZero(0.0)) continue;
          const Matrix3d found = (cut ? pairs.cut : pairs.whole).block<3, 3>(3 * k, 3 * l);
          EXPECT_LT((found - wanted).norm(), 0.015 * wanted.norm()) << "edge at " << edge_at << ", " << k << ", " << l;
        }
      }
    }
  }
}

TEST(DensityPairs, NormalRowsAloneAreThoseOfAll) {
  const HalfSpaceResponse half_space({.youngs_modulus = 0.2, .poisson_ratio = 0.45}, 2.0, 0.9);  // fades
  ASSERT_GT(half_space.fade, 0.0);
  const Lattice lattice = lattice_cut_at(0.3);
  const DensityResponses all = density_responses(half_space, lattice.vertices, lattice.triangles, 1.0, false);
  const DensityResponses normal = density_responses(half_space, lattice.vertices, lattice.triangles, 1.0, true);
  const auto rows = Eigen::seqN(Eigen::fix<0>, normal.cut.rows(), Eigen::fix<3>);
  EXPECT_LT((normal.cut - all.cut(rows, rows)).cwiseAbs().maxCoeff(), 1e-14 * all.cut.cwiseAbs().maxCoeff());
  EXPECT_LT((normal.whole - all.whole(rows, rows)).cwiseAbs().maxCoeff(), 1e-14 * all.whole.cwiseAbs().maxCoeff());
  EXPECT_EQ(all.cut, Eigen::MatrixXd(all.cut.transpose()));
}

TEST(DensityPairs, WhatIsNotCutDiffersNot) {
  const HalfSpaceResponse half_space({.youngs_modulus = 0.2, .poisson_ratio = 0.5}, 100.0, 1.0);
  Lattice lattice = lattice_cut_at(100.0);
  for (DensityVertex& vertex : lattice.vertices) vertex.is_cut = true;
  ASSERT_TRUE(lattice.triangles.front().same_cells);
  const DensityResponses pairs = density_responses(half_space, lattice.vertices, lattice.triangles, 1.0, false);
  EXPECT_EQ(pairs.cut, pairs.whole);
  EXPECT_GT(pairs.cut.diagonal().minCoeff(), 0.0);
}

}  // namespace
}  // namespace touchstone::fem
