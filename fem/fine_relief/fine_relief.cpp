#include "fem/fine_relief/fine_relief.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/error.h"
#include "fem/contact/patch_motion.h"
#include "fem/contact/triangle_gap.h"
#include "fem/fine_relief/pixel_box.h"
#include "fem/fine_relief/pixel_part.h"

namespace touchstone::fem {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kMostWidenings = 8;
constexpr double kLeastFacing = 0.05;  // cosine between the surface's normal and the contact's: no contact is beyond it
constexpr double kFarthestBehind = 0.5;  // of the thickness, as ContactSurface::farthest_behind
constexpr double kSettled = 1e-7;        // mm
constexpr int kMostSteps = 40;
constexpr double kLeastGain = 0.8;  // of the error: where a step leaves more, the next ones are shorter
constexpr double kShortestStep = 0.1;
constexpr double kPartMargin = 0.5;  // of an edge, round the vertices with pressure, where contact is looked for first

PixelBox whole_surface(const SmoothSurface& surface, double pitch) {
  Eigen::Vector2d low = surface.vertices().front();
  Eigen::Vector2d high = low;
  for (const auto& v : surface.vertices()) {
    low = low.cwiseMin(v);
    high = high.cwiseMax(v);
  }
  const Eigen::Vector2d half = Eigen::Vector2d::Constant(0.5 * pitch);
  return box_around(low + (0.5 + 1e-9) * half, high - (0.5 + 1e-9) * half, pitch);
}

/// The vertices with pressure, and with `neighbours` all that their triangles reach.
PixelBox pressed_box(const SmoothSurface& surface, const PressState& press, bool neighbours, double margin,
                     double pitch) {
  Eigen::Vector2d low = Eigen::Vector2d::Constant(kInfinity);
  Eigen::Vector2d high = -low;
  const auto pressed = [&](int v) { return press.traction(v, 2) != 0.0; };
  for (const auto& t : surface.gel().triangles) {
    if (std::none_of(t.begin(), t.end(), pressed)) continue;
    for (const int v : t) {
      if (!neighbours && !pressed(v)) continue;
      low = low.cwiseMin(surface.vertices()[static_cast<std::size_t>(v)]);
      high = high.cwiseMax(surface.vertices()[static_cast<std::size_t>(v)]);
    }
  }
  const Eigen::Vector2d around = Eigen::Vector2d::Constant(margin);
  return box_around(low - around, high + around, pitch);
}

/// Puts the patch's mean motion in place of the tangential displacement. Uniform splines whose coefficients are a
/// linear field's values at the knots are that field.
void move_as_a_whole(const SmoothSurface& surface, const PressState& press, SplineField& along) {
  const Compliance& gel = surface.gel();
  std::vector<Eigen::Vector3d> points, normals, displacements;
  std::vector<double> pressures;
  const Eigen::VectorXd weight = gel.mass * Eigen::VectorXd::Ones(gel.mass.cols());
  const Eigen::MatrixX3d weighted = gel.mass * press.surface_displacement;
  for (std::size_t v = 0; v < gel.vertices.size(); ++v) {
    const auto row = static_cast<Eigen::Index>(v);
    if (!(surface.pressure(press, v) > 0.0)) continue;
    points.push_back(gel.vertices[v]);
    normals.push_back(surface.place(surface.vertices()[v]).normal);
    displacements.push_back(weighted.row(row).transpose() / weight[row]);
    pressures.push_back(weight[row] * surface.pressure(press, v));
  }
  const PatchMotion patch = mean_patch_motion(points, normals, displacements, pressures);
  for (Eigen::Index row = 0; row < along.coefficients.rows(); ++row) {
    along.coefficients.row(row) = patch.displacement(surface.place(along.knot(row)).point).transpose();
  }
}

/// The contact's pixels as solve_pixel_contact has them, from SmoothSurface's scale: `gap` times scale^0.5, and
/// `share`.
struct PixelGaps {
  std::vector<double> gap, share;
};

/// The gap goes along the surface's normal, from the undeformed surface plus `rest` out to the object, looked up where
/// the gel has moved to along the surface. Endless beside a dome, and where the surface doesn't face `direction`.
/// `along` and `rest`: the coarse displacement's parts at the pixels; `object_rest`: what the object itself gives way,
/// less its answer to the coarse pressure.
PixelGaps gaps(const SmoothSurface& surface, const PixelGrid& grid, const Eigen::MatrixX3d& along,
               const Eigen::MatrixX3d& rest, const Eigen::Vector3d& direction, const QuadraticField& object_rest,
               const ContactShape& shape, const RigidTransform& gel_from_object) {
  const RigidTransform object_from_gel = gel_from_object.inverse();
  const BoundingBall ball = bounding_ball(shape);
  const Eigen::Vector3d centre = gel_from_object * ball.centre;
  const double farthest_behind = surface.is_flat() ? kInfinity : kFarthestBehind * surface.gel().thickness;
  PixelGaps found{std::vector<double>(grid.size(), kInfinity), std::vector<double>(grid.size(), 1.0)};
  tbb::parallel_for(0, grid.ny, [&](int j) {
    for (int i = 0; i < grid.nx; ++i) {
      const Eigen::Vector2d at = grid.centre(i, j);
      if (at.squaredNorm() > surface.rim_radius() * surface.rim_radius()) continue;
      const std::size_t k = grid.at(i, j);
      const auto row = static_cast<Eigen::Index>(k);
      const SurfacePlace place = surface.place(at);
      const double facing = place.normal.dot(direction);
      if (facing < kLeastFacing) continue;
      const Eigen::Vector3d point = place.point + along.row(row).transpose();
      if ((point - centre).cross(place.normal).squaredNorm() > ball.radius * ball.radius) continue;
      const auto entry =
          entry_before(shape, object_from_gel * point, object_from_gel.turn(place.normal), farthest_behind);
      if (!entry) continue;
      found.gap[k] = std::sqrt(place.scale) * (*entry - rest(row, 2) + object_rest.at(at));
      found.share[k] = std::sqrt(place.scale) * facing;
    }
  });
  return found;
}

/// The previous answer's pressure on a grid of the same lattice, as a layer's load.
std::vector<double> carried_over(const SmoothSurface& surface, const ReliefAnswer* previous, const PixelGrid& grid) {
  if (previous == nullptr || previous->grid.size() == 0 || previous->grid.pitch != grid.pitch) return {};
  return SmoothSurface::load(on_grid(previous->grid, previous->pressure, grid, 0.0), surface.scales(grid));
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
  if (!settings.follow_surface) move_as_a_whole(surface, press, coarse.along);
  answer.along = coarse.along;
  answer.rest = coarse.rest;
  answer.layer = std::move(coarse.layer);
  answer.direction = coarse.direction;
  answer.coarse_force = coarse.force;
  answer.misfit = coarse.largest_misfit;
  answer.solved.converged = true;
  if (!(coarse.force > 0.0)) return answer;
  double opposite = 0.0;
  QuadraticField object_rest;
  if (settings.object) {
    check(*settings.object);
    const double nu = settings.object->poisson_ratio;
    opposite = (1.0 - nu * nu) / settings.object->youngs_modulus;
    object_rest = surface.object_rest(press, opposite, answer.layer);
  }

  const double margin = settings.margin >= 0.0 ? settings.margin : std::max(2.0 * surface.edge(), 0.25 * gel.thickness);
  const PixelBox whole = whole_surface(surface, settings.pitch);
  PixelBox box = of_kept_size(common(pressed_box(surface, press, true, margin, settings.pitch), whole), whole);
  const PixelBox pressed = pressed_box(surface, press, false, kPartMargin * surface.edge(), settings.pitch);
  std::vector<double> start;
  Eigen::MatrixX3d rest;
  for (int widening = 0;; ++widening) {
    const PixelGrid grid = box.grid(settings.pitch);
    check(grid);
    rest = coarse.rest.on_lattice(grid.columns_x(), grid.rows_y());
    const PixelGaps found = gaps(surface, grid, coarse.along.on_lattice(grid.columns_x(), grid.rows_y()), rest,
                                 coarse.direction, object_rest, shape, press.gel_from_object);
    PixelContact contact{found.gap, {}, found.share};
    if (settings.control == ReliefControl::force) contact.force = coarse.force;
    start = answer.grid.size() > 0 ? on_grid(answer.grid, answer.pressure, grid, 0.0)
                                   : carried_over(surface, previous, grid);
    const auto response = [&](const PixelGrid& of) { return surface.response(of.nx, of.ny, of.pitch, opposite); };
    answer.solved =
        solve_in_part(response, box, common(pressed, box), settings.pitch, contact, settings.tolerance, start);
    answer.grid = grid;
    answer.pressure = std::move(answer.solved.pressure);  // as the layer's load, so far
    const PixelBox wider = common(widened(box, grid, answer.pressure), whole);
    if (wider == box || widening == kMostWidenings) break;
    box = of_kept_size(wider, whole);
  }
  const PixelBox inner{whole.left + 1, whole.bottom + 1, whole.right - 1, whole.top - 1};
  const PixelGrid& grid = answer.grid;
  answer.height = std::move(answer.solved.displacement);
  if (opposite > 0.0) {  // the gel's part of it
    const std::shared_ptr<const LayerResponse> layer = surface.response(grid.nx, grid.ny, grid.pitch);
    layer->apply(answer.pressure, answer.height, *layer->make_scratch());
  }
  const std::vector<double> scales = surface.scales(grid);
  for (std::size_t k = 0; k < scales.size(); ++k) {
    answer.height[k] /= std::sqrt(scales[k]);
    answer.pressure[k] /= scales[k] * std::sqrt(scales[k]);
  }
  answer.contact.assign(grid.size(), 0);
  for (int j = 0; j < grid.ny; ++j) {
    for (int i = 0; i < grid.nx; ++i) {
      const std::size_t k = grid.at(i, j);
      const bool at_rim = grid.centre(i, j).norm() + grid.pitch > surface.rim_radius();
      answer.height[k] = rest(static_cast<Eigen::Index>(k), 2) - answer.height[k];
      answer.contact[k] = answer.pressure[k] > 0.0;
      const bool inside = box.left + i >= inner.left && box.left + i <= inner.right && box.bottom + j >= inner.bottom &&
                          box.bottom + j <= inner.top;
      if (answer.contact[k] && (!inside || at_rim)) answer.at_the_edge = true;
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

double HeightField::at(const Eigen::Vector2d& seen) const {
  // Which material point has come to stand over this place: a fixed point. Where the surface is flat, or strains are
  // well below one, whole steps lead there; on a flank the displacement goes aside as it goes in, and they may have to
  // be shorter.
  const Eigen::Vector2d wanted = surface_.place(surface_.laid_out(seen)).point.head<2>();
  Eigen::Vector2d over = wanted;  // the undeformed surface there
  Eigen::Vector3d now;
  double step = 1.0;
  double last = std::numeric_limits<double>::infinity();
  for (int k = 0; k < kMostSteps; ++k) {
    const Eigen::Vector2d material = surface_.laid_out(over);
    const SurfacePlace place = surface_.place(material);
    now = place.point + along_.at(material) + at_material(material) * place.normal;
    const Eigen::Vector2d off = wanted - now.head<2>();
    const double error = off.norm();
    if (error < kSettled) break;
    if (error > kLeastGain * last) step = std::max(kShortestStep, 0.5 * step);
    last = error;
    over += step * off;
  }
  return now.z() - surface_.rest_height(wanted);
}

}  // namespace touchstone::fem
