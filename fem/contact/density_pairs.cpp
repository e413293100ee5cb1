#include "fem/contact/density_pairs.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <utility>

#include "core/wide_clones.h"

namespace touchstone::fem {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Mean of 1/r within a disc of area A: 16 / (3 pi radius).
const double kSelf = 16.0 / (3.0 * std::sqrt(std::numbers::pi));
// Variance of a triangle's points along an axis, of its area (equilateral).
constexpr double kSpread = 0.0962;
// Edges between triangles' middles: nearer ones go cell by cell.
constexpr double kNear = 1.6;
// Edges between vertices: farther ones go by their densities' moments.
constexpr double kFar = 2.2;
// Edges: triangles whose middles are farther apart have no vertices nearer than kFar, were it for triangles of twice
// the mean edge.
constexpr double kNoneNear = kFar + 2.4;

/// A cell that sees others.
struct Seeing {
  double x, y, z;
  double area;
  double largest;
};

/// Means of 1/r (mm^-1) between a cell and `count` others, and where it is from them. Of a cell and itself: the larger
/// of both cells' own mean.
TS_WIDE_CLONES void see(const Seeing& cell, const double* __restrict x, const double* __restrict y,
                        const double* __restrict z, const double* __restrict area, const double* __restrict largest,
                        int count, double* __restrict dx, double* __restrict dy, double* __restrict dz,
                        double* __restrict inverse) {
  for (int j = 0; j < count; ++j) {
    dx[j] = cell.x - x[j];
    dy[j] = cell.y - y[j];
    dz[j] = cell.z - z[j];
    const double near = 1.0 / std::sqrt(dx[j] * dx[j] + dy[j] * dy[j] + dz[j] * dz[j]);
    const double mean = near + 0.5 * kSpread * (cell.area + area[j]) * (near * near * near);
    const double least = mean < largest[j] ? mean : largest[j];
    inverse[j] = least < cell.largest ? least : cell.largest;
  }
}

/// ResponseTerms, one row after the other. `axes`: the tangents, one after the other.
TS_WIDE_CLONES void see_terms(double nu, const double* axes, const double* __restrict dx, const double* __restrict dy,
                              const double* __restrict dz, const double* __restrict inverse, int count,
                              double* __restrict terms) {
  double* const normal = terms;
  double* const first = terms + count;
  double* const second = terms + 2 * count;
  double* const first_first = terms + 3 * count;
  double* const first_second = terms + 4 * count;
  double* const second_second = terms + 5 * count;
#pragma GCC ivdep
  for (int j = 0; j < count; ++j) {
    const double x = axes[0] * dx[j] + axes[1] * dy[j] + axes[2] * dz[j];
    const double y = axes[3] * dx[j] + axes[4] * dy[j] + axes[5] * dz[j];
    const ResponseTerms at(nu, x, y, inverse[j]);
    normal[j] = at.normal;
    first[j] = at.first;
    second[j] = at.second;
    first_first[j] = at.first_first;
    first_second[j] = at.first_second;
    second_second[j] = at.second_second;
  }
}

/// To each of `count` columns of 3 * `terms` rows (row after row) the terms of it times a cell's three densities.
TS_WIDE_CLONES void add_products(const double* __restrict of_cells, int terms, int count, double density_0,
                                 double density_1, double density_2, double* __restrict sums) {
  for (int term = 0; term < terms; ++term) {
    const double* const row = of_cells + term * count;
    double* const sum_0 = sums + 3 * term * count;
    double* const sum_1 = sum_0 + count;
    double* const sum_2 = sum_1 + count;
    for (int j = 0; j < count; ++j) {
      sum_0[j] += density_0 * row[j];
      sum_1[j] += density_1 * row[j];
      sum_2[j] += density_2 * row[j];
    }
  }
}

/// Sums over pairs of vertices, triangle by triangle where they are near each other.
class DensityPairs {
 public:
  DensityPairs(const HalfSpaceResponse& half_space, const std::vector<DensityVertex>& vertices, double edge,
               bool normal_only)
      : half_space_(half_space),
        vertices_(vertices),
        edge_(edge),
        normal_only_(normal_only),
        near_(static_cast<Eigen::Index>(vertices.size()), static_cast<Eigen::Index>(vertices.size())) {
    const Eigen::Index rows = (normal_only ? 1 : 3) * near_.rows();
    result_.cut = result_.whole = Eigen::MatrixXd::Zero(rows, rows);
    const double far2 = std::pow(kFar * edge, 2);
    near_.setZero();
    for (Eigen::Index l = 0; l < near_.cols(); ++l) {
      if (!of(l).is_cut) continue;
      for (Eigen::Index k = 0; k < near_.rows(); ++k) {
        near_(k, l) = (of(k).at - of(l).at).squaredNorm() < far2;
        if (near_(k, l)) near_(l, k) = true;
      }
    }
  }

  DensityResponses sum(const std::vector<DensityTriangle>& triangles) {
    const double near2 = std::pow(kNear * edge_, 2);
    const double none_near2 = std::pow(kNoneNear * edge_, 2);
    // By themselves, since most pairs aren't looked at further.
    std::vector<Vector3d> middle;
    std::vector<char> is_cut;  // one of their corners' hats is
    for (const DensityTriangle& triangle : triangles) {
      middle.push_back(triangle.middle);
      is_cut.push_back(std::any_of(triangle.place.begin(), triangle.place.end(),
                                   [&](int place) { return place >= 0 && of(place).is_cut; }));
    }
    for (std::size_t a = 0; a < triangles.size(); ++a) {
      for (std::size_t b = a; b < triangles.size(); ++b) {
        if (!is_cut[a] && !is_cut[b]) continue;
        const double distance2 = (middle[a] - middle[b]).squaredNorm();
        if (distance2 < near2) {
          add_near(triangles[a], triangles[b]);
        } else if (distance2 < none_near2) {
          add_centres(triangles[a], triangles[b]);
        }
      }
    }
    add_far(triangles);
    for (Eigen::MatrixXd* half : {&result_.cut, &result_.whole}) {
      half->triangularView<Eigen::StrictlyUpper>() = half->transpose();
    }
    return std::move(result_);
  }

 private:
  static constexpr int kTerms = FarDensities::kTerms;

  /// The densities of two triangles' cells, and where their response goes.
  struct Weighed {
    const Eigen::MatrixX3d& a;
    const Eigen::MatrixX3d& b;
    Eigen::MatrixXd& out;
  };

  const DensityVertex& of(Eigen::Index k) const { return vertices_[static_cast<std::size_t>(k)]; }
  bool wanted(const DensityTriangle& a, int i, const DensityTriangle& b, int j) const {
    return a.place[i] >= 0 && b.place[j] >= 0 && near_(a.place[i], b.place[j]);
  }

  void add_near(const DensityTriangle& a, const DensityTriangle& b) {
    bool any = false;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) any = any || wanted(a, i, b, j);
    }
    if (!any) return;
    const std::array<Weighed, 2> sets{Weighed{a.now.cells.density, b.now.cells.density, result_.cut},
                                      Weighed{a.whole.cells.density, b.whole.cells.density, result_.whole}};
    const std::span<const Weighed> all(sets);
    if (a.same_cells && b.same_cells) {
      add_cells(a, a.now.cells, b, b.now.cells, all);
    } else {
      add_cells(a, a.now.cells, b, b.now.cells, all.first(1));
      add_cells(a, a.whole.cells, b, b.whole.cells, all.last(1));
    }
  }

  void add_cells(const DensityTriangle& a, const CellColumns& in_a, const DensityTriangle& b, const CellColumns& in_b,
                 std::span<const Weighed> sets) {
    const bool same = &a == &b;
    const int count = in_b.size();
    const auto n = static_cast<std::size_t>(count);
    const int terms = normal_only_ ? 1 : kTerms;
    const double nu = half_space_.nu;
    const std::array<double, 6> axes{a.first[0], a.first[1], a.first[2], a.second[0], a.second[1], a.second[2]};
    from_.resize(3 * n);
    inverse_.resize(n);
    terms_.resize(static_cast<std::size_t>(terms) * n);
    const std::size_t of_set = static_cast<std::size_t>(3 * terms) * n;
    sums_.assign(sets.size() * of_set, 0.0);
    double* const dx = from_.data();
    double* const dy = dx + count;
    double* const dz = dy + count;
    for (int k = 0; k < in_a.size(); ++k) {
      const Seeing cell{in_a.at(k, 0), in_a.at(k, 1), in_a.at(k, 2), in_a.area[k], in_a.largest[k]};
      see(cell, in_b.at.col(0).data(), in_b.at.col(1).data(), in_b.at.col(2).data(), in_b.area.data(),
          in_b.largest.data(), count, dx, dy, dz, inverse_.data());
      if (normal_only_) {
        for (int j = 0; j < count; ++j) terms_[j] = (1.0 - nu) * inverse_[j];
      } else {
        see_terms(nu, axes.data(), dx, dy, dz, inverse_.data(), count, terms_.data());
        if (same) terms_[3 * count + k] = terms_[5 * count + k] = 0.5 * nu * inverse_[k];
      }
      if (half_space_.fade > 0.0) {
        for (int j = 0; j < count; ++j) {
          const double faded = half_space_.faded(std::sqrt(dx[j] * dx[j] + dy[j] * dy[j] + dz[j] * dz[j]));
          for (int term = 0; term < terms; ++term) terms_[term * count + j] *= faded;
        }
      }
      for (std::size_t s = 0; s < sets.size(); ++s) {
        const auto density = sets[s].a.row(k);
        add_products(terms_.data(), terms, count, density[0], density[1], density[2], sums_.data() + s * of_set);
      }
    }
    for (std::size_t s = 0; s < sets.size(); ++s) {
      const Eigen::Map<const Eigen::MatrixXd> sums(sums_.data() + s * of_set, count, 3 * terms);
      const Eigen::Matrix<double, Eigen::Dynamic, 3> u =
          half_space_.scale * Eigen::Matrix<double, Eigen::Dynamic, 3>(sums.transpose().lazyProduct(sets[s].b));
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
          if (!wanted(a, i, b, j)) continue;
          const auto of_term = [&](int term) { return u(3 * term + i, j); };
          add_block(sets[s].out, a.place[i], b.place[j], block_of(of_term), same);
        }
      }
    }
  }

  void add_centres(const DensityTriangle& a, const DensityTriangle& b) {
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        if (!wanted(a, i, b, j)) continue;
        add_centres(a, a.now.corner[i], b.now.corner[j], {a.place[i], b.place[j]}, result_.cut);
        add_centres(a, a.whole.corner[i], b.whole.corner[j], {a.place[i], b.place[j]}, result_.whole);
      }
    }
  }
  void add_centres(const DensityTriangle& a, const DensityMoments& one, const DensityMoments& other,
                   const std::array<int, 2>& place, Eigen::MatrixXd& out) {
    if (!(one.mass > 0.0) || !(other.mass > 0.0)) return;
    const Vector3d from = one.centre - other.centre;
    const Matrix3d block =
        one.mass * other.mass * half_space_.between(a.first.dot(from), a.second.dot(from), from.squaredNorm());
    add_block(out, place[0], place[1], block, false);
  }

  /// What vertices do to each other that aren't near.
  void add_far(const std::vector<DensityTriangle>& triangles) {
    std::vector<DensityMoments> cut(vertices_.size());
    std::vector<DensityMoments> whole(vertices_.size());
    for (const DensityTriangle& triangle : triangles) {
      for (int i = 0; i < 3; ++i) {
        if (triangle.place[i] < 0) continue;
        const auto k = static_cast<std::size_t>(triangle.place[i]);
        whole[k].add(triangle.whole.corner[i]);
        if (vertices_[k].is_cut) cut[k].add(triangle.now.corner[i]);
      }
    }
    for (std::size_t k = 0; k < vertices_.size(); ++k) {
      if (!vertices_[k].is_cut) cut[k] = whole[k];
    }
    FarDensities far(half_space_, normal_only_);
    std::vector<int> places;
    std::vector<const DensityMoments*> others;
    for (Eigen::Index k = 0; k < near_.rows(); ++k) {
      for (const auto& [moments, out] : {std::pair{&cut, &result_.cut}, std::pair{&whole, &result_.whole}}) {
        const DensityMoments& own = (*moments)[static_cast<std::size_t>(k)];
        if (!(own.mass > 0.0)) continue;
        places.clear();
        others.clear();
        for (Eigen::Index l = k + 1; l < near_.rows(); ++l) {
          const DensityMoments& other = (*moments)[static_cast<std::size_t>(l)];
          if (near_(l, k) || !(of(k).is_cut || of(l).is_cut) || !(other.mass > 0.0)) continue;
          places.push_back(static_cast<int>(l));
          others.push_back(&other);
        }
        if (others.empty()) continue;
        const Eigen::ArrayXXd& terms = far.responses(own, of(k).first, of(k).second, others);
        for (std::size_t j = 0; j < places.size(); ++j) {
          const auto of_term = [&](int term) { return terms(static_cast<Eigen::Index>(j), term); };
          add_block(*out, static_cast<int>(k), places[j], block_of(of_term), false);
        }
      }
    }
  }

  /// A response at a row's vertex to a traction at a column's. Of normal rows alone only its first number is set.
  Matrix3d block_of(const auto& of_term) const {
    Matrix3d block;
    if (normal_only_) {
      block(0, 0) = of_term(0);
    } else {
      block << of_term(0), of_term(1), of_term(2), -of_term(1), of_term(0) + of_term(3), of_term(4), -of_term(2),
          of_term(4), of_term(0) + of_term(5);
    }
    return block;
  }

  /// Into the lower half. `all`: of vertices of one triangle, whose pairs are added in both orders.
  void add_block(Eigen::MatrixXd& out, int row, int column, const Matrix3d& block, bool all) const {
    normal_only_ ? add_part<1>(out, row, column, block, all) : add_part<3>(out, row, column, block, all);
  }
  template <int Each>
  static void add_part(Eigen::MatrixXd& out, int row, int column, const Matrix3d& block, bool all) {
    const auto part = block.topLeftCorner<Each, Each>();
    const auto at = [&](int to_row, int to_column) { return out.block<Each, Each>(Each * to_row, Each * to_column); };
    if (row == column && !all) {
      at(row, column) += part + part.transpose();
    } else if (row >= column) {
      at(row, column) += part;
    } else if (!all) {
      at(column, row) += part.transpose();
    }
  }

  const HalfSpaceResponse& half_space_;
  const std::vector<DensityVertex>& vertices_;
  double edge_;
  bool normal_only_;
  Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic> near_;
  DensityResponses result_;
  std::vector<double> from_, inverse_, terms_, sums_;  // for each cell that is seen
};

}  // namespace

CellColumns::CellColumns(const std::vector<DensityCell>& list) {
  const auto n = static_cast<Eigen::Index>(list.size());
  at.resize(n, 3);
  area.resize(n);
  density.resize(n, 3);
  for (Eigen::Index k = 0; k < n; ++k) {
    const DensityCell& cell = list[static_cast<std::size_t>(k)];
    at.row(k) = cell.at;
    area[k] = cell.area;
    density.row(k) = cell.density;
  }
  largest = kSelf / area.sqrt();
}

TriangleDensity::TriangleDensity(const std::vector<DensityCell>& list) : cells(list) {
  for (int a = 0; a < 3; ++a) {
    DensityMoments& moments = corner[a];
    for (const DensityCell& cell : list) {
      moments.mass += cell.density[a];
      moments.centre += cell.density[a] * cell.at;
    }
    if (!(moments.mass > 0.0)) continue;
    moments.centre /= moments.mass;
    for (const DensityCell& cell : list) {
      const Vector3d away = cell.at - moments.centre;
      moments.spread += cell.density[a] / moments.mass * away * away.transpose();
    }
  }
}

DensityTriangle::DensityTriangle(const std::vector<DensityCell>& with_cut, const std::vector<DensityCell>& with_whole)
    : now(with_cut),
      whole(with_whole),
      same_cells(now.cells.size() == whole.cells.size() && (now.cells.at == whole.cells.at).all() &&
                 (now.cells.area == whole.cells.area).all()) {}

DensityResponses density_responses(const HalfSpaceResponse& half_space, const std::vector<DensityVertex>& vertices,
                                   const std::vector<DensityTriangle>& triangles, double edge, bool normal_only) {
  return DensityPairs(half_space, vertices, edge, normal_only).sum(triangles);
}

}  // namespace touchstone::fem
