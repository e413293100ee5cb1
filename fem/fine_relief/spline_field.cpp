#include "fem/fine_relief/spline_field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "core/error.h"

namespace touchstone::fem {
namespace {

/// Values of the four uniform cubic B-splines that reach over a place t in [0, 1] of its interval.
std::array<double, 4> splines(double t) {
  const double s = 1.0 - t;
  return {s * s * s / 6.0, (4.0 - 3.0 * t * t * (2.0 - t)) / 6.0, (4.0 - 3.0 * s * s * (2.0 - s)) / 6.0,
          t * t * t / 6.0};
}

/// The interval that a coordinate (in knots) lies in, and where.
std::pair<int, double> interval(double x, int intervals) {
  x = std::clamp(x, 0.0, static_cast<double>(intervals));
  const int i = std::min(static_cast<int>(x), intervals - 1);
  return {i, x - i};
}

/// Calls visit(spline, value) for the 16 splines that reach over a point.
template <typename Visit>
void for_splines(const SplineField& field, const Eigen::Vector2d& point, const Visit& visit) {
  const auto [i, u] = interval((point.x() - field.first.x()) / field.spacing, field.nx);
  const auto [j, v] = interval((point.y() - field.first.y()) / field.spacing, field.ny);
  const auto along_x = splines(u);
  const auto along_y = splines(v);
  for (int b = 0; b < 4; ++b) {
    for (int a = 0; a < 4; ++a) visit((j + b) * (field.nx + 3) + i + a, along_x[a] * along_y[b]);
  }
}

/// int s_i^(p) s_j^(p) over the line, in knots, for p = 0, 1, 2, by Gauss' rule of three points and the splines' own
/// polynomials (degree 6 in 4 points is exact).
std::array<Eigen::MatrixXd, 3> line_products(int intervals) {
  const int n = intervals + 3;
  std::array<Eigen::MatrixXd, 3> products;
  for (auto& m : products) m = Eigen::MatrixXd::Zero(n, n);
  const std::array<double, 4> x = {0.0694318442029737, 0.3300094782075719, 0.6699905217924281, 0.9305681557970263};
  const std::array<double, 4> w = {0.1739274225687269, 0.3260725774312731, 0.3260725774312731, 0.1739274225687269};
  for (int q = 0; q < 4; ++q) {
    const double t = x[q];
    const double s = 1.0 - t;
    const std::array<std::array<double, 4>, 3> value = {
        splines(t), std::array<double, 4>{-0.5 * s * s, 1.5 * t * t - 2.0 * t, -1.5 * s * s + 2.0 * s, 0.5 * t * t},
        std::array<double, 4>{s, 3.0 * t - 2.0, 3.0 * s - 2.0, t}};
    for (int p = 0; p < 3; ++p) {
      for (int i = 0; i < intervals; ++i) {
        for (int a = 0; a < 4; ++a) {
          for (int b = 0; b < 4; ++b) products[p](i + a, i + b) += w[q] * value[p][a] * value[p][b];
        }
      }
    }
  }
  return products;
}

/// int |second derivatives|^2 of the field, times spacing^2: the thin plate's bending.
Eigen::SparseMatrix<double> bending(int nx, int ny) {
  const auto x = line_products(nx);
  const auto y = line_products(ny);
  std::vector<Eigen::Triplet<double>> entries;
  const auto near = [](int i, int n) { return std::pair(std::max(0, i - 3), std::min(n - 1, i + 3)); };
  for (int j = 0; j < ny + 3; ++j) {
    for (int i = 0; i < nx + 3; ++i) {
      const auto [jl, jh] = near(j, ny + 3);
      const auto [il, ih] = near(i, nx + 3);
      for (int l = jl; l <= jh; ++l) {
        for (int k = il; k <= ih; ++k) {
          entries.emplace_back(j * (nx + 3) + i, l * (nx + 3) + k,
                               x[2](i, k) * y[0](j, l) + 2.0 * x[1](i, k) * y[1](j, l) + x[0](i, k) * y[2](j, l));
        }
      }
    }
  }
  const int n = (nx + 3) * (ny + 3);
  Eigen::SparseMatrix<double> result(n, n);
  result.setFromTriplets(entries.begin(), entries.end());
  return result;
}

}  // namespace

Eigen::Vector3d SplineField::at(const Eigen::Vector2d& point) const {
  Eigen::Vector3d value = Eigen::Vector3d::Zero();
  for_splines(*this, point, [&](int spline, double weight) { value += weight * coefficients.row(spline).transpose(); });
  return value;
}

Eigen::MatrixX3d SplineField::on_lattice(std::span<const double> x, std::span<const double> y) const {
  Eigen::MatrixX3d values(static_cast<Eigen::Index>(x.size() * y.size()), 3);
  std::vector<std::pair<int, std::array<double, 4>>> along_x;
  for (const double at : x) {
    const auto [i, u] = interval((at - first.x()) / spacing, nx);
    along_x.emplace_back(i, splines(u));
  }
  const int width = nx + 3;
  Eigen::MatrixX3d line(width, 3);  // the coefficients of a line of constant y
  Eigen::Index row = 0;
  for (const double at : y) {
    const auto [j, v] = interval((at - first.y()) / spacing, ny);
    const auto along_y = splines(v);
    line.setZero();
    for (int b = 0; b < 4; ++b) line += along_y[b] * coefficients.middleRows((j + b) * width, width);
    for (const auto& [i, weights] : along_x) {
      values.row(row++) = weights[0] * line.row(i) + weights[1] * line.row(i + 1) + weights[2] * line.row(i + 2) +
                          weights[3] * line.row(i + 3);
    }
  }
  return values;
}

Eigen::Vector2d SplineField::knot(Eigen::Index row) const {
  const auto i = static_cast<double>(row % (nx + 3));
  const auto j = static_cast<double>(row / (nx + 3));
  return first + spacing * Eigen::Vector2d(i - 1.0, j - 1.0);
}

SplineFit::SplineFit(const PixelGrid& grid, const Eigen::SparseMatrix<double, Eigen::RowMajor>& hats,
                     const Eigen::VectorXd& weight, const Eigen::Vector2d& low, const Eigen::Vector2d& high,
                     double spacing, double half_wave)
    : weight_(weight) {
  const Eigen::Vector2d size = high - low;
  empty_.spacing = spacing;
  empty_.nx = std::max(1, static_cast<int>(std::ceil(size.x() / spacing)));
  empty_.ny = std::max(1, static_cast<int>(std::ceil(size.y() / spacing)));
  empty_.first = 0.5 * (low + high) - 0.5 * spacing * Eigen::Vector2d(empty_.nx, empty_.ny);
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(16 * grid.size());
  for (int j = 0; j < grid.ny; ++j) {
    for (int i = 0; i < grid.nx; ++i) {
      for_splines(empty_, grid.centre(i, j), [&](int spline, double value) {
        entries.emplace_back(static_cast<int>(grid.at(i, j)), spline, value);
      });
    }
  }
  Eigen::SparseMatrix<double, Eigen::RowMajor> sampled(hats.rows(), (empty_.nx + 3) * (empty_.ny + 3));
  sampled.setFromTriplets(entries.begin(), entries.end());
  Eigen::VectorXd sums = hats.transpose() * Eigen::VectorXd::Ones(hats.rows());
  for (Eigen::Index v = 0; v < sums.size(); ++v) {
    if (sums[v] > 0.0) continue;
    sums[v] = 1.0;
    weight_[v] = 0.0;
  }
  means_ = hats.transpose() * sampled;
  means_ = sums.cwiseInverse().asDiagonal() * means_;
  // min sum weight (mean - data)^2 + stiffness int |bending|^2: waves of number k are followed by 1/(1 + stiffness
  // k^4).
  const double stiffness = std::pow(half_wave / (2.0 * std::numbers::pi), 4.0) / (spacing * spacing);
  factor_.compute(Eigen::SparseMatrix<double>(means_.transpose() * weight_.asDiagonal() * means_) +
                  stiffness * bending(empty_.nx, empty_.ny));
  TS_ASSERT(factor_.info() == Eigen::Success);
}

SplineField SplineFit::fit(const Eigen::MatrixX3d& means) const {
  SplineField field = empty_;
  const Eigen::MatrixX3d right = means_.transpose() * weight_.asDiagonal() * means;
  field.coefficients = factor_.solve(right);
  return field;
}

}  // namespace touchstone::fem
