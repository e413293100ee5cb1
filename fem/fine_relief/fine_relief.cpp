#include "fem/fine_relief/fine_relief.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/error.h"
#include "fem/contact/patch_motion.h"

namespace touchstone::fem {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kMostWidenings = 8;
constexpr int kBorder = 4;  // pixels: contact nearer to the grid's border than this widens it

struct PixelBox {
  int left, bottom, right, top;  // whole pixels of the lattice whose centres stand at (i + 0.5) * pitch; inclusive

  PixelGrid grid(double pitch) const {
    return {right - left + 1, top - bottom + 1, pitch, pitch * Eigen::Vector2d(left + 0.5, bottom + 0.5)};
  }
  bool operator==(const PixelBox&) const = default;
};

PixelBox box_around(const Eigen::Vector2d& low, const Eigen::Vector2d& high, double pitch) {
  const auto pixel = [&](double x) { return static_cast<int>(std::floor(std::clamp(x / pitch, -1e8, 1e8))); };
  return {pixel(low.x()), pixel(low.y()), pixel(high.x()), pixel(high.y())};
}

PixelBox common(const PixelBox& a, const PixelBox& b) {
  return {std::max(a.left, b.left), std::max(a.bottom, b.bottom), std::min(a.right, b.right), std::min(a.top, b.top)};
}

PixelBox whole_surface(const Compliance& gel, double pitch) {
  Eigen::Vector2d low = gel.vertices.front().head<2>();
  Eigen::Vector2d high = low;
  for (const auto& v : gel.vertices) {
    low = low.cwiseMin(v.head<2>());
    high = high.cwiseMax(v.head<2>());
  }
  const Eigen::Vector2d half = Eigen::Vector2d::Constant(0.5 * pitch);
  return box_around(low + (0.5 + 1e-9) * half, high - (0.5 + 1e-9) * half, pitch);
}

/// The box widened to one of few sizes, each a sixth more than the one before, so that their responses are kept from
/// press to press (SmoothSurface::response); not beyond `whole`.
PixelBox of_kept_size(const PixelBox& box, const PixelBox& whole) {
  const auto widen = [](int& low, int& high, int least, int most) {
    int size = 24;
    while (size < high - low + 1) size += (size + 5) / 6;
    size = std::min(size, most - least + 1);
    low = std::max(least, low - (size - (high - low + 1)) / 2);
    high = std::min(most, low + size - 1);
    low = high - size + 1;
  };
  PixelBox wide = box;
  widen(wide.left, wide.right, whole.left, whole.right);
  widen(wide.bottom, wide.top, whole.bottom, whole.top);
  return wide;
}

/// The vertices with pressure and their neighbours' reach.
PixelBox pressed_box(const Compliance& gel, const PressState& press, double margin, double pitch) {
  Eigen::Vector2d low = Eigen::Vector2d::Constant(kInfinity);
  Eigen::Vector2d high = -low;
  for (const auto& t : gel.triangles) {
    const bool pressed = std::any_of(t.begin(), t.end(), [&](int v) { return press.traction(v, 2) != 0.0; });
    if (!pressed) continue;
    for (const int v : t) {
      low = low.cwiseMin(gel.vertices[v].head<2>());
      high = high.cwiseMax(gel.vertices[v].head<2>());
    }
  }
  const Eigen::Vector2d around = Eigen::Vector2d::Constant(margin);
  return box_around(low - around, high + around, pitch);
}

/// Puts the patch's mean motion in place of the tangential displacement. Uniform splines whose coefficients are a
/// linear field's values at the knots are that field.
void move_as_a_whole(const Compliance& gel, const PressState& press, SplineField& along) {
  std::vector<Eigen::Vector3d> points, normals, displacements;
  std::vector<double> pressures;
  const Eigen::VectorXd weight = gel.mass * Eigen::VectorXd::Ones(gel.mass.cols());
  const Eigen::MatrixX3d weighted = gel.mass * press.surface_displacement;
  for (std::size_t v = 0; v < gel.vertices.size(); ++v) {
    const auto row = static_cast<Eigen::Index>(v);
    if (!(press.traction(row, 2) < 0.0)) continue;
    points.push_back(gel.vertices[v]);
    normals.push_back(Eigen::Vector3d::UnitZ());
    displacements.push_back(weighted.row(row).transpose() / weight[row]);
    pressures.push_back(-weight[row] * press.traction(row, 2));
  }
  const PatchMotion patch = mean_patch_motion(points, normals, displacements, pressures);
  for (Eigen::Index row = 0; row < along.coefficients.rows(); ++row) {
    const Eigen::Vector2d knot = along.knot(row);
    along.coefficients.row(row) = patch.displacement({knot.x(), knot.y(), 0.0}).transpose();
  }
}

/// Gap per pixel from the undeformed surface plus `rest` up to the object, looked up where the gel has moved to along
/// the surface. Endless beside a dome. `along` and `rest`: the coarse displacement's parts at the pixels.
std::vector<double> gaps(const SmoothSurface& surface, const PixelGrid& grid, const Eigen::MatrixX3d& along,
                         const Eigen::MatrixX3d& rest, const ContactShape& shape,
                         const RigidTransform& gel_from_object) {
  const RigidTransform object_from_gel = gel_from_object.inverse();
  const Eigen::Vector3d up = object_from_gel.turn(Eigen::Vector3d::UnitZ());
  const BoundingBall ball = bounding_ball(shape);
  const Eigen::Vector3d centre = gel_from_object * ball.centre;
  std::vector<double> gap(grid.size(), kInfinity);
  tbb::parallel_for(0, grid.ny, [&](int j) {
    for (int i = 0; i < grid.nx; ++i) {
      const Eigen::Vector2d at = grid.centre(i, j);
      if (at.squaredNorm() > surface.rim_radius() * surface.rim_radius()) continue;
      const std::size_t k = grid.at(i, j);
      const auto row = static_cast<Eigen::Index>(k);
      const Eigen::Vector3d point(at.x() + along(row, 0), at.y() + along(row, 1), surface.rest_height(at));
      if ((point - centre).head<2>().squaredNorm() > ball.radius * ball.radius) continue;
      if (const auto entry = first_entry(shape, object_from_gel * point, up)) gap[k] = *entry - rest(row, 2);
    }
  });
  return gap;
}

/// The previous answer's pressure on a grid of the same lattice.
std::vector<double> carried_over(const ReliefAnswer* previous, const PixelGrid& grid) {
  if (previous == nullptr || previous->grid.size() == 0 || previous->grid.pitch != grid.pitch) return {};
  const Eigen::Vector2d offset = (grid.first - previous->grid.first) / grid.pitch;
  const auto di = static_cast<int>(std::lround(offset.x()));
  const auto dj = static_cast<int>(std::lround(offset.y()));
  std::vector<double> pressure(grid.size(), 0.0);
  for (int j = 0; j < grid.ny; ++j) {
    for (int i = 0; i < grid.nx; ++i) {
      if (i + di < 0 || i + di >= previous->grid.nx || j + dj < 0 || j + dj >= previous->grid.ny) continue;
      pressure[grid.at(i, j)] = previous->pressure[previous->grid.at(i + di, j + dj)];
    }
  }
  return pressure;
}

/// The box with those sides moved out that contact has come near to.
PixelBox widened(const PixelBox& box, const PixelGrid& grid, const std::vector<double>& pressure) {
  PixelBox wider = box;
  const auto pressed = [&](int i, int j) { return pressure[grid.at(i, j)] > 0.0; };
  const int step_x = std::max(16, grid.nx / 4);
  const int step_y = std::max(16, grid.ny / 4);
  for (int j = 0; j < grid.ny; ++j) {
    for (int i = 0; i < std::min(kBorder, grid.nx); ++i) {
      if (pressed(i, j)) wider.left = box.left - step_x;
      if (pressed(grid.nx - 1 - i, j)) wider.right = box.right + step_x;
    }
  }
  for (int i = 0; i < grid.nx; ++i) {
    for (int j = 0; j < std::min(kBorder, grid.ny); ++j) {
      if (pressed(i, j)) wider.bottom = box.bottom - step_y;
      if (pressed(i, grid.ny - 1 - j)) wider.top = box.top + step_y;
    }
  }
  return wider;
}

double interpolated(const PixelGrid& grid, const std::vector<double>& values, const Eigen::Vector2d& place) {
  const double x = std::clamp(place.x(), 0.0, static_cast<double>(grid.nx - 1));
  const double y = std::clamp(place.y(), 0.0, static_cast<double>(grid.ny - 1));
  const int i = std::min(static_cast<int>(x), std::max(0, grid.nx - 2));
  const int j = std::min(static_cast<int>(y), std::max(0, grid.ny - 2));
  const int i1 = std::min(i + 1, grid.nx - 1);
  const int j1 = std::min(j + 1, grid.ny - 1);
  const double u = x - i;
  const double v = y - j;
  return (1.0 - v) * ((1.0 - u) * values[grid.at(i, j)] + u * values[grid.at(i1, j)]) +
         v * ((1.0 - u) * values[grid.at(i, j1)] + u * values[grid.at(i1, j1)]);
}

}  // namespace

ReliefAnswer solve_fine_relief(const SmoothSurface& surface, const PressState& press, const ContactShape& shape,
                               const ReliefSettings& settings, const ReliefAnswer* previous) {
  if (!(settings.pitch > 0.0) || !std::isfinite(settings.pitch)) {
    fail("the relief's pixel pitch is {} mm; it must be above 0 and finite", settings.pitch);
  }
  if (!(settings.tolerance.gap_mm > 0.0)) fail("the relief's tolerance is {} mm", settings.tolerance.gap_mm);
  const Compliance& gel = surface.gel();
  SmoothDisplacement coarse = surface.displacement(press);
  ReliefAnswer answer;
  if (!settings.follow_surface) move_as_a_whole(gel, press, coarse.along);
  answer.along = coarse.along;
  answer.rest = coarse.rest;
  answer.layer = std::move(coarse.layer);
  answer.coarse_force = coarse.force;
  answer.misfit = coarse.largest_misfit;
  answer.solved.converged = true;
  if (!(coarse.force > 0.0)) return answer;

  const double margin = settings.margin >= 0.0 ? settings.margin : std::max(2.0 * surface.edge(), 0.25 * gel.thickness);
  const PixelBox whole = whole_surface(gel, settings.pitch);
  PixelBox box = of_kept_size(common(pressed_box(gel, press, margin, settings.pitch), whole), whole);
  std::vector<double> start;
  Eigen::MatrixX3d rest;
  for (int widening = 0;; ++widening) {
    const PixelGrid grid = box.grid(settings.pitch);
    check(grid);
    const auto layer = surface.response(grid.nx, grid.ny, grid.pitch);
    rest = coarse.rest.on_lattice(grid.columns_x(), grid.rows_y());
    const std::vector<double> gap = gaps(surface, grid, coarse.along.on_lattice(grid.columns_x(), grid.rows_y()), rest,
                                         shape, press.gel_from_object);
    PixelContact contact{gap, {}};
    if (settings.control == ReliefControl::force) contact.force = coarse.force;
    start = carried_over(answer.grid.size() > 0 ? &answer : previous, grid);
    answer.solved = solve_pixel_contact(*layer, contact, settings.tolerance, start);
    answer.grid = grid;
    answer.pressure = std::move(answer.solved.pressure);
    const PixelBox wider = common(widened(box, grid, answer.pressure), whole);
    if (wider == box || widening == kMostWidenings) break;
    box = of_kept_size(wider, whole);
  }
  const PixelBox inner{whole.left + 1, whole.bottom + 1, whole.right - 1, whole.top - 1};
  const PixelGrid& grid = answer.grid;
  answer.height = std::move(answer.solved.displacement);
  answer.contact.assign(grid.size(), 0);
  for (int j = 0; j < grid.ny; ++j) {
    for (int i = 0; i < grid.nx; ++i) {
      const std::size_t k = grid.at(i, j);
      answer.height[k] = rest(static_cast<Eigen::Index>(k), 2) - answer.height[k];
      answer.contact[k] = answer.pressure[k] > 0.0;
      const bool inside = box.left + i >= inner.left && box.left + i <= inner.right && box.bottom + j >= inner.bottom &&
                          box.bottom + j <= inner.top;
      if (answer.contact[k] && !inside) answer.at_the_edge = true;
    }
  }
  return answer;
}

HeightField::HeightField(const SmoothSurface& surface, const PressState& press, const ReliefAnswer* fine)
    : surface_(surface), coarse_grid_(surface.reference_grid()) {
  along_ = fine != nullptr ? fine->along : surface.displacement(press).along;
  if (fine == nullptr || fine->grid.size() == 0) {
    coarse_ = surface.normal_displacement(press);
    return;
  }
  coarse_ = surface.normal_displacement(press, fine->rest, fine->layer, fine->grid, fine->pressure);
  fine_grid_ = fine->grid;
  fine_ = fine->height;
}

double HeightField::at_material(const Eigen::Vector2d& material) const {
  if (!fine_.empty()) {
    const Eigen::Vector2d place = (material - fine_grid_.first) / fine_grid_.pitch;
    if (place.x() >= 0.0 && place.y() >= 0.0 && place.x() <= fine_grid_.nx - 1 && place.y() <= fine_grid_.ny - 1) {
      return interpolated(fine_grid_, fine_, place);
    }
  }
  return interpolated(coarse_grid_, coarse_, (material - coarse_grid_.first) / coarse_grid_.pitch);
}

double HeightField::at(const Eigen::Vector2d& point) const {
  // Which material point has come to stand over this place: a fixed point, since strains are well below one.
  Eigen::Vector2d material = point;
  for (int k = 0; k < 12; ++k) {
    const Eigen::Vector2d next = point - along_.at(material).head<2>();
    const bool settled = (next - material).norm() < 1e-7;
    material = next;
    if (settled) break;
  }
  return at_material(material) + surface_.rest_height(material) - surface_.rest_height(point);
}

}  // namespace touchstone::fem
