#include "fem/contact/density_pairs.h"

#include <algorithm>
#include <cmath>
#include <numbers>
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

/// What HalfSpaceResponse::between is made of, over its scale: of a normal traction by a normal one, along either
/// tangent by a normal one, and what tangential ones have beyond the first. `axes`: the tangents, one after the other.
TS_WIDE_CLONES void see_terms(double nu, const double* axes, const double* __restrict dx, const double* __restrict dy,
                              const double* __restrict dz, const double* __restrict inverse, int count,
                              double* __restrict terms) {
  double* const normal = terms;
  double* const first = terms + count;
  double* const second = terms + 2 * count;
  double* const first_first = terms + 3 * count;
  double* const first_second = terms + 4 * count;
  double* const second_second = terms + 5 * count;
  for (int j = 0; j < count; ++j) {
    const double x = axes[0] * dx[j] + axes[1] * dy[j] + axes[2] * dz[j];
    const double y = axes[3] * dx[j] + axes[4] * dy[j] + axes[5] * dz[j];
    const double flat2 = x * x + y * y;
    const double over_flat2 = 1.0 / (flat2 > 1e-100 ? flat2 : 1e-100);
    const double square = flat2 * (inverse[j] * inverse[j]);
    const double shear = (0.5 - nu) * (square < 1.0 ? square : 1.0) * over_flat2;
    const double along = nu * inverse[j] * over_flat2;
    normal[j] = (1.0 - nu) * inverse[j];
    first[j] = shear * x;
    second[j] = shear * y;
    first_first[j] = along * (x * x);
    first_second[j] = along * x * y;
    second_second[j] = along * (y * y);
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

TriangleDensity::TriangleDensity(const std::vector<DensityCell>& list) : cells(list), mass(Vector3d::Zero()) {
  centre.fill(Vector3d::Zero());
  for (const DensityCell& cell : list) {
    mass += cell.density;
    for (int a = 0; a < 3; ++a) centre[a] += cell.density[a] * cell.at;
  }
  for (int a = 0; a < 3; ++a) {
    if (mass[a] > 0.0) centre[a] /= mass[a];
  }
}

DensityTriangle::DensityTriangle(const std::vector<DensityCell>& with_cut, const std::vector<DensityCell>& with_whole)
    : now(with_cut),
      whole(with_whole),
      same_cells(now.cells.size() == whole.cells.size() && (now.cells.at == whole.cells.at).all() &&
                 (now.cells.area == whole.cells.area).all()) {}

DensityPairs::DensityPairs(const HalfSpaceResponse& half_space, int vertices, bool normal_only)
    : half_space_(half_space), normal_only_(normal_only) {
  const Eigen::Index rows = (normal_only ? 1 : 3) * static_cast<Eigen::Index>(vertices);
  near_.cut = near_.whole = Eigen::MatrixXd::Zero(rows, rows);
  for (Far* far : {&far_cut_, &far_whole_}) {
    far->columns = Eigen::MatrixXd::Zero(rows, normal_only ? 3 : 9);
    far->sum = Eigen::MatrixXd::Zero(rows, rows);
  }
}

void DensityPairs::add(const DensityTriangle& a, const DensityTriangle& b, bool near) {
  if (!near) {
    if (at_ != &a) {
      gather();
      at_ = &a;
    }
    add_far(a, a.now, b, b.now, far_cut_.columns);
    add_far(a, a.whole, b, b.whole, far_whole_.columns);
    return;
  }
  const std::array<Weighed, 2> sets{Weighed{a.now.cells.density, b.now.cells.density, near_.cut},
                                    Weighed{a.whole.cells.density, b.whole.cells.density, near_.whole}};
  const std::span<const Weighed> all(sets);
  if (a.same_cells && b.same_cells) {
    add_cells(a, a.now.cells, b, b.now.cells, all);
  } else {
    add_cells(a, a.now.cells, b, b.now.cells, all.first(1));
    add_cells(a, a.whole.cells, b, b.whole.cells, all.last(1));
  }
}

void DensityPairs::add_cells(const DensityTriangle& a, const CellColumns& in_a, const DensityTriangle& b,
                             const CellColumns& in_b, std::span<const Weighed> sets) {
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
        Matrix3d block;
        if (normal_only_) {
          block(0, 0) = u(i, j);
        } else {
          const auto of = [&](int term) { return u(3 * term + i, j); };
          block << of(0), of(1), of(2), -of(1), of(0) + of(3), of(4), -of(2), of(4), of(0) + of(5);
        }
        add_block(sets[s].out, a.place[i], b.place[j], block, !same);
      }
    }
  }
}

void DensityPairs::add_far(const DensityTriangle& a, const TriangleDensity& of_a, const DensityTriangle& b,
                           const TriangleDensity& of_b, Eigen::MatrixXd& columns) {
  for (int i = 0; i < 3; ++i) {
    if (a.place[i] < 0 || !(of_a.mass[i] > 0.0)) continue;
    for (int j = 0; j < 3; ++j) {
      if (b.place[j] < 0 || !(of_b.mass[j] > 0.0)) continue;
      const Vector3d from = of_a.centre[i] - of_b.centre[j];
      const double mass = of_a.mass[i] * of_b.mass[j];
      if (normal_only_) {
        columns(b.place[j], i) +=
            mass * half_space_.scale * (1.0 - half_space_.nu) * half_space_.faded(from.norm()) / from.norm();
      } else {
        columns.block<3, 3>(3 * b.place[j], 3 * i) +=
            mass * half_space_.between(a.first.dot(from), a.second.dot(from), from.squaredNorm()).transpose();
      }
    }
  }
}

void DensityPairs::gather() {
  if (at_ == nullptr) return;
  const Eigen::Index each = normal_only_ ? 1 : 3;
  for (Far* far : {&far_cut_, &far_whole_}) {
    for (int i = 0; i < 3; ++i) {
      if (at_->place[i] < 0) continue;
      far->sum.middleCols(each * at_->place[i], each) += far->columns.middleCols(each * i, each);
    }
    far->columns.setZero();
  }
}

DensityPairs::Responses DensityPairs::take() {
  gather();
  near_.cut += far_cut_.sum + far_cut_.sum.transpose();
  near_.whole += far_whole_.sum + far_whole_.sum.transpose();
  return std::move(near_);
}

/// `mirrored`: to the other place, too. Of the block only its first row and column if there are normal rows alone.
void DensityPairs::add_block(Eigen::MatrixXd& out, int row, int column, const Matrix3d& block, bool mirrored) {
  if (row < 0 || column < 0) return;
  if (normal_only_) {
    out(row, column) += block(0, 0);
    if (mirrored) out(column, row) += block(0, 0);
    return;
  }
  out.block<3, 3>(3 * row, 3 * column) += block;
  if (mirrored) out.block<3, 3>(3 * column, 3 * row) += block.transpose();
}

}  // namespace touchstone::fem
