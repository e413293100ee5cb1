#include "sim/view/membrane.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/error.h"

namespace touchstone::sim {
namespace {

constexpr double kGrowth = 1.3;            // of the spacing from line to line outside of the relief's grid
constexpr double kSameLine = 1e-6;         // of a pixel: nearer lines are one but for rounding
constexpr double kDeepestChord_mm = 1e-3;  // that a cell outside of the grid may lie below a dome: a fifth of what an
                                           // `accuracy` allows heights by default

/// Lines across one axis: the grid's own pixels, and from its border on ever wider ones to the surface's edges. A grid
/// that ends on an edge, or a part of a pixel beyond it, has no more lines there: else two would be one.
std::vector<double> sheet_lines(double first, double pitch, int pixels, double low, double high, double widest) {
  std::vector<double> lines;
  const double last = first + pitch * (pixels - 1);
  const auto outwards = [&](double from, double sign, double to) {
    std::vector<double> steps;
    double sum = 0.0;
    const double length = sign * (to - from);
    if (length < kSameLine * pitch) return steps;
    for (double step = kGrowth * pitch; sum < length; step = std::min(widest, kGrowth * step)) {
      steps.push_back(step);
      sum += step;
    }
    // Shrunk to end on the edge.
    std::vector<double> at;
    double gone = 0.0;
    for (const double step : steps) {
      gone += step * length / sum;
      at.push_back(from + sign * gone);
    }
    return at;
  };
  const std::vector<double> below = outwards(first, -1.0, low);
  lines.assign(below.rbegin(), below.rend());
  for (int i = 0; i < pixels; ++i) lines.push_back(first + pitch * i);
  const std::vector<double> above = outwards(last, 1.0, high);
  lines.insert(lines.end(), above.begin(), above.end());
  return lines;
}

}  // namespace

Membrane::Membrane(const SceneSpec& scene, const Plan& plan, const fem::Compliance& gel)
    : Membrane(scene, plan,
               std::make_shared<const fem::SmoothSurface>(
                   gel, scene.device.gel.dome() ? scene.device.gel.dome()->sphere_radius_mm : INFINITY)) {}

Membrane::Membrane(const SceneSpec& scene, const Plan& plan, std::shared_ptr<const fem::SmoothSurface> surface)
    : surface_(std::move(surface)), pixel_(scene.membrane.pixel_um * 1e-3), relief_pixel_(plan.relief_pixel_mm) {
  if (plan.fine_relief) shape_ = contact_shape(scene.object);
  if (plan.elastic_object && scene.object.elastic) {
    object_ = fem::ElasticMaterial{scene.object.elastic->youngs_modulus_MPa, scene.object.elastic->poisson_ratio};
  }
  const Eigen::Vector2d size = scene.membrane.height_size_mm.value_or(2.0 * scene.device.mesh.fine_half_extent_mm);
  columns_ = std::max(1, static_cast<int>(std::lround(size.x() / pixel_)));
  rows_ = std::max(1, static_cast<int>(std::lround(size.y() / pixel_)));
  if (scene.outputs.height && std::max(columns_, rows_) > kMostHeightPixels) {
    fail_at(scene.membrane.where, "membrane: a height map of {} x {} pixels; at most {} a side are allowed", columns_,
            rows_, kMostHeightPixels);
  }
}

std::optional<fem::ReliefAnswer> Membrane::relief(const fem::PressState& press) const {
  if (!shape_) return std::nullopt;
  fem::ReliefSettings settings;
  settings.pitch = relief_pixel_;
  settings.object = object_;
  return fem::solve_fine_relief(*surface_, press, *shape_, settings);
}

Membrane::Sheet Membrane::sheet(const fem::PressState& press, const fem::ReliefAnswer& relief) const {
  const fem::PixelGrid& grid = relief.grid;
  TS_ASSERT(grid.size() > 0);
  Eigen::Vector2d low = surface_->vertices().front();
  Eigen::Vector2d high = low;
  for (const Eigen::Vector2d& v : surface_->vertices()) {
    low = low.cwiseMin(v);
    high = high.cwiseMax(v);
  }
  // A flat triangle lies below a sphere by the square of its longest side, here a square's diagonal, over eight radii.
  const double widest = std::min(2.0 * surface_->edge(), std::sqrt(4.0 * kDeepestChord_mm * surface_->sphere_radius()));
  const auto x = sheet_lines(grid.first.x(), grid.pitch, grid.nx, low.x(), high.x(), widest);
  const auto y = sheet_lines(grid.first.y(), grid.pitch, grid.ny, low.y(), high.y(), widest);
  const auto left = static_cast<int>(std::find(x.begin(), x.end(), grid.first.x()) - x.begin());
  const auto bottom = static_cast<int>(std::find(y.begin(), y.end(), grid.first.y()) - y.begin());
  const int columns = static_cast<int>(x.size());
  const int rows = static_cast<int>(y.size());
  const fem::HeightField field(*surface_, press, &relief);

  Sheet sheet;
  std::vector<Eigen::Vector3d> vertices(x.size() * y.size());
  std::vector<char> wet(vertices.size(), 0);
  // The lattice goes on beside a dome; there its points are drawn in onto the rim.
  const double rim = surface_->rim_radius();
  const Eigen::MatrixX3d along = relief.along.on_lattice(x, y);
  std::vector<char> beside(vertices.size(), 0);
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const std::size_t k = static_cast<std::size_t>(j) * x.size() + i;
      Eigen::Vector2d material(x[static_cast<std::size_t>(i)], y[static_cast<std::size_t>(j)]);
      beside[k] = material.norm() >= rim;
      if (beside[k]) material *= rim / material.norm();
      const fem::SurfacePlace place = surface_->place(material);
      vertices[k] = place.point + field.at_material(material) * place.normal;
      vertices[k] += beside[k] ? relief.tangential(material)
                               : Eigen::Vector3d(along.row(static_cast<Eigen::Index>(k)).transpose());
      sheet.rest.push_back(place.point);
      const int gi = i - left;
      const int gj = j - bottom;
      if (gi >= 0 && gj >= 0 && gi < grid.nx && gj < grid.ny) wet[k] = relief.contact[grid.at(gi, gj)];
    }
  }
  const auto beside_rim = [&](const std::array<int, 3>& t) {
    if (!std::isfinite(rim)) return false;
    if (beside[static_cast<std::size_t>(t[0])] && beside[static_cast<std::size_t>(t[1])] &&
        beside[static_cast<std::size_t>(t[2])]) {
      return true;
    }
    const auto rest = [&](int k) {
      return sheet.rest[static_cast<std::size_t>(t[static_cast<std::size_t>(k)])].head<2>();
    };
    const Eigen::Vector2d ab = rest(1) - rest(0);
    const Eigen::Vector2d ac = rest(2) - rest(0);
    // Drawn together along one ray from the middle.
    return ab.x() * ac.y() - ab.y() * ac.x() < 1e-6 * grid.pixel_area();
  };
  for (int j = 0; j + 1 < rows; ++j) {
    for (int i = 0; i + 1 < columns; ++i) {
      const int a = j * columns + i;
      const int c = a + columns;
      for (const std::array<int, 3>& t : {std::array{a, a + 1, c + 1}, std::array{a, c + 1, c}}) {
        if (beside_rim(t)) continue;
        const bool on_object = wet[static_cast<std::size_t>(t[0])] && wet[static_cast<std::size_t>(t[1])] &&
                               wet[static_cast<std::size_t>(t[2])];
        (on_object ? sheet.wet : sheet.dry).triangles.push_back(t);
      }
    }
  }
  sheet.dry.vertices = vertices;
  sheet.wet.vertices = std::move(vertices);
  return sheet;
}

cv::Mat Membrane::height(const fem::PressState& press, const std::optional<fem::ReliefAnswer>& relief) const {
  const fem::HeightField field(*surface_, press, relief ? &*relief : nullptr);
  cv::Mat map(rows_, columns_, CV_32F);
  for (int j = 0; j < rows_; ++j) {
    auto* row = map.ptr<float>(j);
    for (int i = 0; i < columns_; ++i) {
      const Eigen::Vector2d at(pixel_ * (i + 0.5 - 0.5 * columns_), pixel_ * (j + 0.5 - 0.5 * rows_));
      row[i] = static_cast<float>(field.at(at));
    }
  }
  return map;
}

}  // namespace touchstone::sim
