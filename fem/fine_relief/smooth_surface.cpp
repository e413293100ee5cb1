#include "fem/fine_relief/smooth_surface.h"

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "core/error.h"
#include "core/units.h"

namespace touchstone::fem {
namespace {

constexpr double kFlatness = 1e-9;  // of the surface's width, off the plane or the sphere
constexpr double kPixelsAnEdge = 8.0;
constexpr int kMostReferencePixels = 768;  // a side
constexpr int kMostWidenings = 2;          // of reference pixels, for a difference of pressures seen from afar
constexpr double kKnotsAThickness = 4.0;
constexpr double kEdgesAKnot = 2.5;
constexpr double kKnotsAWave = 4.0;       // the wavelength that the fit follows by half
constexpr double kEdgesAKnotAlong = 1.5;  // the same for the tangential displacement, which follows friction's detail
constexpr double kEdgesAWaveAlong = 3.0;

struct Box {
  Eigen::Vector2d low = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector2d high = -low;
};

Box box_of(const std::vector<Eigen::Vector2d>& vertices) {
  Box box;
  for (const auto& v : vertices) {
    box.low = box.low.cwiseMin(v);
    box.high = box.high.cwiseMax(v);
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
Eigen::SparseMatrix<double, Eigen::RowMajor> sampled_hats(const std::vector<std::array<int, 3>>& triangles,
                                                          const std::vector<Eigen::Vector2d>& vertices,
                                                          const PixelGrid& grid) {
  std::vector<char> taken(grid.size(), 0);
  std::vector<Eigen::Triplet<double>> entries;
  for (const auto& t : triangles) {
    std::array<Eigen::Vector2d, 3> c;
    for (int k = 0; k < 3; ++k) c[k] = (vertices[t[k]] - grid.first) / grid.pitch;
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
                                                    static_cast<Eigen::Index>(vertices.size()));
  hats.setFromTriplets(entries.begin(), entries.end());
  return hats;
}

/// Pressure of fine pixels on wider ones, shared bilinearly: force and torque stay.
std::vector<double> gathered(const PixelGrid& fine, std::span<const double> pressure, const PixelGrid& wide) {
  std::vector<double> result(wide.size(), 0.0);
  const double share = fine.pixel_area() / wide.pixel_area();
  for (int j = 0; j < fine.ny; ++j) {
    for (int i = 0; i < fine.nx; ++i) {
      const double p = share * pressure[fine.at(i, j)];
      if (p == 0.0) continue;
      const Eigen::Vector2d place = (fine.centre(i, j) - wide.first) / wide.pitch;
      const double x = std::clamp(place.x(), 0.0, wide.nx - 1.0);
      const double y = std::clamp(place.y(), 0.0, wide.ny - 1.0);
      const int a = std::min(static_cast<int>(x), std::max(0, wide.nx - 2));
      const int b = std::min(static_cast<int>(y), std::max(0, wide.ny - 2));
      const int a1 = std::min(a + 1, wide.nx - 1);
      const int b1 = std::min(b + 1, wide.ny - 1);
      result[wide.at(a, b)] += p * (1.0 - (x - a)) * (1.0 - (y - b));
      result[wide.at(a1, b)] += p * (x - a) * (1.0 - (y - b));
      result[wide.at(a, b1)] += p * (1.0 - (x - a)) * (y - b);
      result[wide.at(a1, b1)] += p * (x - a) * (y - b);
    }
  }
  return result;
}

/// Values at wide pixels, bilinearly at others.
std::vector<double> spread_out(const PixelGrid& wide, const std::vector<double>& values, const PixelGrid& fine) {
  struct Place {
    int low, high;
    double share;
  };
  const auto places = [](const std::vector<double>& at, double first, double pitch, int count) {
    std::vector<Place> all;
    for (const double one : at) {
      const double x = std::clamp((one - first) / pitch, 0.0, count - 1.0);
      const int low = std::min(static_cast<int>(x), std::max(0, count - 2));
      all.push_back({low, std::min(low + 1, count - 1), x - low});
    }
    return all;
  };
  const std::vector<Place> columns = places(fine.columns_x(), wide.first.x(), wide.pitch, wide.nx);
  const std::vector<Place> rows = places(fine.rows_y(), wide.first.y(), wide.pitch, wide.ny);
  std::vector<double> result(fine.size());
  for (int j = 0; j < fine.ny; ++j) {
    const double* const below = values.data() + wide.at(0, rows[j].low);
    const double* const above = values.data() + wide.at(0, rows[j].high);
    const double up = rows[j].share;
    for (int i = 0; i < fine.nx; ++i) {
      const auto& [low, high, along] = columns[i];
      const double at_low = below[low] + along * (below[high] - below[low]);
      const double at_high = above[low] + along * (above[high] - above[low]);
      result[fine.at(i, j)] = at_low + up * (at_high - at_low);
    }
  }
  return result;
}

}  // namespace

SmoothSurface::SmoothSurface(const Compliance& gel, double sphere_radius)
    : gel_(gel),
      edge_(shortest_edge(gel)),
      sphere_radius_(sphere_radius),
      rim_radius_(std::numeric_limits<double>::infinity()) {
  double widest = 0.0;
  for (const auto& v : gel.vertices) widest = std::max(widest, v.head<2>().norm());
  if (!is_flat() && !(widest <= std::sin(kSteepestDome) * sphere_radius)) {
    fail(
        "fine relief and smooth surfaces are for flat and domed gels only: a cap of {:.4g} mm radius on a sphere of "
        "{:.4g} mm slopes by {:.3g} degrees at its rim, allowed are {:.3g}",
        widest, sphere_radius, std::asin(std::min(1.0, widest / sphere_radius)) / kRadiansPerDegree,
        kSteepestDome / kRadiansPerDegree);
  }
  const Eigen::Vector3d middle(0.0, 0.0, -sphere_radius);
  for (const Eigen::Vector3d& v : gel.vertices) {
    const double off = is_flat() ? v.z() : (v - middle).norm() - sphere_radius;
    if (std::abs(off) > kFlatness * widest || (!is_flat() && v.z() < -sphere_radius)) {
      fail(
          "fine relief and smooth surfaces are for flat and domed gels only: the outer surface of this one reaches to "
          "({:.4g}, {:.4g}, {:.4g}) mm",
          v.x(), v.y(), v.z());
    }
    if (is_flat()) {
      vertices_.push_back(v.head<2>());
      normals_.push_back(Eigen::Vector3d::UnitZ());
    } else {
      vertices_.push_back(v.head<2>() / (1.0 + 0.5 * v.z() / sphere_radius));
      normals_.push_back((v - middle) / sphere_radius);
    }
  }
  if (!is_flat()) {
    rim_radius_ = 0.0;
    for (const auto& v : vertices_) rim_radius_ = std::max(rim_radius_, v.norm());
  }
  const Box box = box_of(vertices_);
  const Eigen::Vector2d size = box.high - box.low;
  const double pitch = std::max({edge_ / kPixelsAnEdge, size.maxCoeff() / kMostReferencePixels});
  PixelGrid grid;
  grid.nx = static_cast<int>(std::ceil(size.x() / pitch - 1e-9));
  grid.ny = static_cast<int>(std::ceil(size.y() / pitch - 1e-9));
  grid.pitch = pitch;
  grid.first = 0.5 * (box.low + box.high) - 0.5 * pitch * Eigen::Vector2d(grid.nx - 1, grid.ny - 1);
  layer_ = std::make_unique<LayerResponse>(gel.material, gel.thickness, grid, GridEdges::free);
  scales_ = scales(grid);
  hats_ = sampled_hats(gel.triangles, vertices_, grid);
  const Eigen::Map<const Eigen::VectorXd> scale(scales_.data(), static_cast<Eigen::Index>(scales_.size()));
  areas_ = scale.cwiseAbs2().asDiagonal() * hats_;
  weight_ = gel.mass * Eigen::VectorXd::Ones(gel.mass.cols());
  pixel_weight_ = grid.pixel_area() * (areas_.transpose() * Eigen::VectorXd::Ones(areas_.rows()));
  for (Eigen::Index v = 0; v < pixel_weight_.size(); ++v) {
    if (!(pixel_weight_[v] > 0.0)) pixel_weight_[v] = grid.pixel_area();  // a sliver between the pixels' centres
  }

  const double knots = std::max(gel.thickness / kKnotsAThickness, kEdgesAKnot * edge_);
  rest_fit_ = std::make_unique<SplineFit>(grid, areas_, weight_, box.low, box.high, knots, kKnotsAWave * knots);
  along_fit_ = std::make_unique<SplineFit>(grid, areas_, weight_, box.low, box.high, kEdgesAKnotAlong * edge_,
                                           kEdgesAWaveAlong * edge_);
}

SmoothSurface::~SmoothSurface() = default;

bool SmoothSurface::is_flat() const {
  return std::isinf(sphere_radius_);
}

SurfacePlace SmoothSurface::place(const Eigen::Vector2d& laid_out) const {
  if (is_flat()) return {{laid_out.x(), laid_out.y(), 0.0}, Eigen::Vector3d::UnitZ(), 1.0};
  const double r2 = laid_out.squaredNorm();
  const double scale = 1.0 / (1.0 + 0.25 * r2 / (sphere_radius_ * sphere_radius_));
  const Eigen::Vector2d seen = scale * laid_out;
  const double z = -0.5 * scale * r2 / sphere_radius_;
  return {
      {seen.x(), seen.y(), z}, {seen.x() / sphere_radius_, seen.y() / sphere_radius_, 1.0 + z / sphere_radius_}, scale};
}

Eigen::Vector2d SmoothSurface::laid_out(const Eigen::Vector2d& seen) const {
  if (is_flat()) return seen;
  const Eigen::Vector2d at = seen / (1.0 + 0.5 * rest_height(seen) / sphere_radius_);
  const double r = at.norm();
  return r > rim_radius_ ? Eigen::Vector2d(at * (rim_radius_ / r)) : at;
}

double SmoothSurface::rest_height(const Eigen::Vector2d& seen) const {
  if (is_flat()) return 0.0;
  const double rim = rim_radius_ / (1.0 + 0.25 * rim_radius_ * rim_radius_ / (sphere_radius_ * sphere_radius_));
  const double r2 = std::min(seen.squaredNorm(), rim * rim);
  return -r2 / (sphere_radius_ + std::sqrt(sphere_radius_ * sphere_radius_ - r2));
}

std::vector<double> SmoothSurface::scales(const PixelGrid& grid) const {
  std::vector<double> scales(grid.size(), 1.0);
  if (is_flat()) return scales;
  for (int j = 0; j < grid.ny; ++j) {
    for (int i = 0; i < grid.nx; ++i) scales[grid.at(i, j)] = place(grid.centre(i, j)).scale;
  }
  return scales;
}

std::vector<double> SmoothSurface::load(std::span<const double> pressure, std::span<const double> scales) {
  std::vector<double> load(pressure.size());
  for (std::size_t k = 0; k < load.size(); ++k) load[k] = pressure[k] * scales[k] * std::sqrt(scales[k]);
  return load;
}

std::vector<double> SmoothSurface::coarse_load(const PressState& press) const {
  Eigen::VectorXd pressures(static_cast<Eigen::Index>(normals_.size()));
  for (std::size_t v = 0; v < normals_.size(); ++v) pressures[static_cast<Eigen::Index>(v)] = pressure(press, v);
  const Eigen::VectorXd at_pixels = hats_ * pressures;
  return load({at_pixels.data(), static_cast<std::size_t>(at_pixels.size())}, scales_);
}

std::vector<double> SmoothSurface::answer_of(const LayerResponse& layer, std::span<const double> load) const {
  std::vector<double> answer(load.size());
  layer.apply(load, answer, *layer.make_scratch());
  for (std::size_t k = 0; k < answer.size(); ++k) answer[k] /= std::sqrt(scales_[k]);
  return answer;
}

Eigen::VectorXd SmoothSurface::hat_means(std::span<const double> values) const {
  const Eigen::Map<const Eigen::VectorXd> at_pixels(values.data(), static_cast<Eigen::Index>(values.size()));
  return reference_grid().pixel_area() * (areas_.transpose() * at_pixels).cwiseQuotient(pixel_weight_);
}

SmoothDisplacement SmoothSurface::displacement(const PressState& press) const {
  SmoothDisplacement result;
  result.layer = answer_of(*layer_, coarse_load(press));
  Eigen::MatrixX3d means = gel_.mass * press.surface_displacement;
  means = weight_.cwiseInverse().asDiagonal() * means;
  Eigen::VectorXd normal_means = hat_means(result.layer);
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  for (std::size_t v = 0; v < normals_.size(); ++v) {
    const auto row = static_cast<Eigen::Index>(v);
    const double into = normals_[v].dot(means.row(row));
    normal_means[row] += into;
    means.row(row) -= into * normals_[v].transpose();
    force += weight_[row] * pressure(press, v) * normals_[v];
  }
  result.force = force.norm();
  if (result.force > 0.0) result.direction = force / result.force;
  result.along = along_fit_->fit(means);
  means.setZero();
  means.col(2) = normal_means;
  result.rest = rest_fit_->fit(means);
  const Eigen::VectorXd misfit = rest_fit_->means_of(result.rest).col(2) - normal_means;
  for (Eigen::Index v = 0; v < misfit.size(); ++v) {
    if (press.traction(v, 2) != 0.0) result.largest_misfit = std::max(result.largest_misfit, std::abs(misfit[v]));
  }
  return result;
}

std::vector<double> SmoothSurface::less_layer(const SplineField& rest, std::vector<double> answer) const {
  const PixelGrid& grid = reference_grid();
  const Eigen::MatrixX3d smooth = rest.on_lattice(grid.columns_x(), grid.rows_y());
  for (std::size_t k = 0; k < answer.size(); ++k) answer[k] = smooth(static_cast<Eigen::Index>(k), 2) - answer[k];
  return answer;
}

std::vector<double> SmoothSurface::normal_displacement(const PressState& press) const {
  SmoothDisplacement coarse = displacement(press);
  return less_layer(coarse.rest, std::move(coarse.layer));
}

std::vector<double> SmoothSurface::normal_displacement(const PressState& press, const SplineField& rest,
                                                       std::span<const double> layer, const PixelGrid& fine,
                                                       std::span<const double> pressure) const {
  const LayerResponse* wide = layer_.get();
  for (int k = 0; k < kMostWidenings && 2.0 * wide->grid().pitch <= kWidestPixel * wide->thickness(); ++k) {
    wide = &wide->on_wider_pixels();
  }
  std::vector<double> difference = gathered(fine, load(pressure, scales(fine)), wide->grid());
  const std::vector<double> coarse = gathered(reference_grid(), coarse_load(press), wide->grid());
  for (std::size_t k = 0; k < difference.size(); ++k) difference[k] -= coarse[k];
  wide->apply(difference, difference, *wide->make_scratch());
  std::vector<double> answer = spread_out(wide->grid(), difference, reference_grid());
  for (std::size_t k = 0; k < answer.size(); ++k) answer[k] = answer[k] / std::sqrt(scales_[k]) + layer[k];
  return less_layer(rest, std::move(answer));
}

QuadraticField SmoothSurface::object_rest(const PressState& press, double opposite,
                                          std::span<const double> layer) const {
  const PixelGrid& grid = reference_grid();
  const std::shared_ptr<const LayerResponse> both = response(grid.nx, grid.ny, grid.pitch, opposite);
  std::vector<double> answer = answer_of(*both, coarse_load(press));
  for (std::size_t k = 0; k < answer.size(); ++k) answer[k] -= layer[k];
  const Eigen::VectorXd means = hat_means(answer);
  std::vector<Eigen::Index> known;
  QuadraticField rest;
  for (Eigen::Index v = 0; v < press.object_gives.size(); ++v) {
    if (std::isnan(press.object_gives[v])) continue;
    known.push_back(v);
    rest.middle += vertices_[static_cast<std::size_t>(v)];
  }
  if (known.empty()) return rest;
  rest.middle /= static_cast<double>(known.size());
  Eigen::MatrixXd terms(std::ssize(known), 6);
  Eigen::VectorXd values(std::ssize(known));
  for (Eigen::Index k = 0; k < values.size(); ++k) {
    const Eigen::Index v = known[static_cast<std::size_t>(k)];
    const double root = std::sqrt(weight_[v]);
    terms.row(k) = root * QuadraticField::terms(vertices_[static_cast<std::size_t>(v)] - rest.middle);
    values[k] = root * (press.object_gives[v] - means[v]);
  }
  // Of a few vertices, or of those in one line, the smallest one that there is.
  rest.coefficients = terms.completeOrthogonalDecomposition().solve(values);
  return rest;
}

std::shared_ptr<const LayerResponse> SmoothSurface::response(int nx, int ny, double pitch, double opposite) const {
  const auto fits = [&](const auto& one) {
    const PixelGrid& grid = one->grid();
    return grid.nx == nx && grid.ny == ny && grid.pitch == pitch && one->opposite() == opposite;
  };
  {
    const std::lock_guard lock(kept_mutex_);
    const auto found = std::find_if(kept_.begin(), kept_.end(), fits);
    if (found != kept_.end()) {
      std::rotate(found, found + 1, kept_.end());
      return kept_.back();
    }
  }
  // Two threads may make the same one; they are equal.
  auto made = std::make_shared<const LayerResponse>(gel_.material, gel_.thickness, PixelGrid{nx, ny, pitch, {0.0, 0.0}},
                                                    GridEdges::free, opposite);
  const std::lock_guard lock(kept_mutex_);
  if (std::none_of(kept_.begin(), kept_.end(), fits)) kept_.push_back(made);
  std::size_t pixels = 0;
  for (auto one = kept_.rbegin(); one != kept_.rend(); ++one) {
    pixels += (*one)->grid().size();
    if (pixels <= kKeptPixels) continue;
    kept_.erase(kept_.begin(), one.base());
    break;
  }
  return made;
}

}  // namespace touchstone::fem
