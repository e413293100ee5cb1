#include "fem/smooth_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/error.h"

namespace touchstone::fem {
namespace {

constexpr double kFlatness = 1e-9;  // of the surface's width
constexpr double kPixelsAnEdge = 8.0;
constexpr int kMostReferencePixels = 768;  // a side
constexpr double kKnotsAThickness = 4.0;
constexpr double kEdgesAKnot = 2.5;
constexpr double kKnotsAWave = 4.0;  // the wavelength at which the fit follows by half

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

struct Box {
  Eigen::Vector2d low = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector2d high = -low;
};

Box box_of(const std::vector<Eigen::Vector3d>& vertices) {
  Box box;
  for (const auto& v : vertices) {
    box.low = box.low.cwiseMin(v.head<2>());
    box.high = box.high.cwiseMax(v.head<2>());
  }
  return box;
}

double shortest_edge(const Compliance& gel) {
  // The median of the finer half: a single sliver says nothing of the mesh.
  std::vector<double> lengths;
  for (const auto& t : gel.triangles) {
    for (int k = 0; k < 3; ++k) lengths.push_back((gel.vertices[t[k]] - gel.vertices[t[(k + 1) % 3]]).norm());
  }
  const auto quarter = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 4);
  std::nth_element(lengths.begin(), quarter, lengths.end());
  return *quarter;
}

/// The P1 functions at the pixels' centres. A centre on an edge belongs to one triangle.
Eigen::SparseMatrix<double, Eigen::RowMajor> sampled_hats(const Compliance& gel, const PixelGrid& grid) {
  std::vector<char> taken(grid.size(), 0);
  std::vector<Eigen::Triplet<double>> entries;
  for (const auto& t : gel.triangles) {
    std::array<Eigen::Vector2d, 3> c;
    for (int k = 0; k < 3; ++k) c[k] = (gel.vertices[t[k]].head<2>() - grid.first) / grid.pitch;
    const auto low = c[0].cwiseMin(c[1]).cwiseMin(c[2]);
    const auto high = c[0].cwiseMax(c[1]).cwiseMax(c[2]);
    const Eigen::Vector2d e1 = c[1] - c[0];
    const Eigen::Vector2d e2 = c[2] - c[0];
    const double twice_area = e1.x() * e2.y() - e1.y() * e2.x();
    const int left = std::max(0, static_cast<int>(std::ceil(low.x() - 1e-9)));
    const int bottom = std::max(0, static_cast<int>(std::ceil(low.y() - 1e-9)));
    for (int j = bottom; j < grid.ny && j <= high.y() + 1e-9; ++j) {
      for (int i = left; i < grid.nx && i <= high.x() + 1e-9; ++i) {
        const Eigen::Vector2d d = Eigen::Vector2d(i, j) - c[0];
        const double b = (d.x() * e2.y() - d.y() * e2.x()) / twice_area;
        const double g = (e1.x() * d.y() - e1.y() * d.x()) / twice_area;
        if (b < -1e-9 || g < -1e-9 || b + g > 1.0 + 1e-9 || taken[grid.at(i, j)]) continue;
        taken[grid.at(i, j)] = 1;
        const int pixel = static_cast<int>(grid.at(i, j));
        entries.emplace_back(pixel, t[0], 1.0 - b - g);
        entries.emplace_back(pixel, t[1], b);
        entries.emplace_back(pixel, t[2], g);
      }
    }
  }
  Eigen::SparseMatrix<double, Eigen::RowMajor> hats(static_cast<Eigen::Index>(grid.size()),
                                                    static_cast<Eigen::Index>(gel.vertices.size()));
  hats.setFromTriplets(entries.begin(), entries.end());
  return hats;
}

}  // namespace

Eigen::Vector3d SplineField::at(const Eigen::Vector2d& point) const {
  Eigen::Vector3d value = Eigen::Vector3d::Zero();
  for_splines(*this, point, [&](int spline, double weight) { value += weight * coefficients.row(spline).transpose(); });
  return value;
}

SmoothSurface::SmoothSurface(const Compliance& gel) : gel_(gel), edge_(shortest_edge(gel)) {
  const Box box = box_of(gel.vertices);
  const Eigen::Vector2d size = box.high - box.low;
  for (const auto& v : gel.vertices) {
    if (std::abs(v.z()) > kFlatness * size.maxCoeff()) {
      fail(
          "fine relief and smooth surfaces are for flat gels only: the outer surface of this one reaches to z = {:.4g} "
          "mm",
          v.z());
    }
  }
  const double pitch = std::max({edge_ / kPixelsAnEdge, size.maxCoeff() / kMostReferencePixels});
  PixelGrid grid;
  grid.nx = static_cast<int>(std::ceil(size.x() / pitch - 1e-9));
  grid.ny = static_cast<int>(std::ceil(size.y() / pitch - 1e-9));
  grid.pitch = pitch;
  grid.first = 0.5 * (box.low + box.high) - 0.5 * pitch * Eigen::Vector2d(grid.nx - 1, grid.ny - 1);
  layer_ = std::make_unique<LayerResponse>(gel.material, gel.thickness, grid, GridEdges::free);
  hats_ = sampled_hats(gel, grid);
  weight_ = gel.mass * Eigen::VectorXd::Ones(gel.mass.cols());
  pixel_weight_ = grid.pixel_area() * (hats_.transpose() * Eigen::VectorXd::Ones(hats_.rows()));

  empty_.spacing = std::max(gel.thickness / kKnotsAThickness, kEdgesAKnot * edge_);
  empty_.nx = std::max(1, static_cast<int>(std::ceil(size.x() / empty_.spacing)));
  empty_.ny = std::max(1, static_cast<int>(std::ceil(size.y() / empty_.spacing)));
  empty_.first = 0.5 * (box.low + box.high) - 0.5 * empty_.spacing * Eigen::Vector2d(empty_.nx, empty_.ny);
  std::vector<Eigen::Triplet<double>> entries;
  for (int j = 0; j < grid.ny; ++j) {
    for (int i = 0; i < grid.nx; ++i) {
      for_splines(empty_, grid.centre(i, j), [&](int spline, double value) {
        entries.emplace_back(static_cast<int>(grid.at(i, j)), spline, value);
      });
    }
  }
  const int count = (empty_.nx + 3) * (empty_.ny + 3);
  Eigen::SparseMatrix<double, Eigen::RowMajor> sampled(hats_.rows(), count);
  sampled.setFromTriplets(entries.begin(), entries.end());
  means_ = hats_.transpose() * sampled;
  for (Eigen::Index v = 0; v < pixel_weight_.size(); ++v) {
    if (pixel_weight_[v] <= 0.0) pixel_weight_[v] = grid.pixel_area();  // a sliver between the pixels: its row is empty
  }
  means_ = (grid.pixel_area() * pixel_weight_.cwiseInverse()).asDiagonal() * means_;
  // min sum weight (mean - data)^2 + stiffness int |bending|^2: waves of number k follow by 1/(1 + stiffness k^4).
  const double half_k = 2.0 * std::numbers::pi / (kKnotsAWave * empty_.spacing);
  const double stiffness = std::pow(half_k, -4.0) / (empty_.spacing * empty_.spacing);
  const Eigen::SparseMatrix<double> normal =
      Eigen::SparseMatrix<double>(means_.transpose() * weight_.asDiagonal() * means_) +
      stiffness * bending(empty_.nx, empty_.ny);
  fit_.compute(normal);
  TS_ASSERT(fit_.info() == Eigen::Success);
}

SmoothSurface::~SmoothSurface() = default;

std::vector<double> SmoothSurface::layer_answer(const PressState& press) const {
  const Eigen::VectorXd pressure = hats_ * (-press.traction.col(2));
  std::vector<double> answer(reference_grid().size());
  const auto scratch = layer_->make_scratch();
  layer_->apply({pressure.data(), answer.size()}, answer, *scratch);
  return answer;
}

SmoothDisplacement SmoothSurface::displacement(const PressState& press) const {
  const std::vector<double> layer = layer_answer(press);
  const Eigen::Map<const Eigen::VectorXd> into(layer.data(), static_cast<Eigen::Index>(layer.size()));
  Eigen::MatrixX3d means = gel_.mass * press.surface_displacement;
  means = weight_.cwiseInverse().asDiagonal() * means;
  const Eigen::VectorXd layer_means =
      reference_grid().pixel_area() * (hats_.transpose() * into).cwiseQuotient(pixel_weight_);
  means.col(2) += layer_means;

  SmoothDisplacement result;
  result.rest = empty_;
  const Eigen::MatrixX3d right = means_.transpose() * weight_.asDiagonal() * means;
  result.rest.coefficients = fit_.solve(right);
  const Eigen::VectorXd misfit = means_ * result.rest.coefficients.col(2) - means.col(2);
  for (Eigen::Index v = 0; v < misfit.size(); ++v) {
    if (press.traction(v, 2) != 0.0) result.largest_misfit = std::max(result.largest_misfit, std::abs(misfit[v]));
  }
  result.force = -weight_.dot(press.traction.col(2));
  return result;
}

std::vector<double> SmoothSurface::normal_displacement(const PressState& press) const {
  std::vector<double> displacement = layer_answer(press);
  const SmoothDisplacement smooth = this->displacement(press);
  const PixelGrid& grid = reference_grid();
  for (int j = 0; j < grid.ny; ++j) {
    for (int i = 0; i < grid.nx; ++i) {
      double& w = displacement[grid.at(i, j)];
      w = smooth.rest.at(grid.centre(i, j)).z() - w;
    }
  }
  return displacement;
}

}  // namespace touchstone::fem
