#include "sim/press/first_touch.h"

#include <cmath>
#include <functional>
#include <limits>

#include "core/error.h"
#include "sim/files/gltf_mesh.h"
#include "sim/scene/device_gel.h"

namespace touchstone::sim {
namespace {

constexpr int kHalf = 40;        // lines on either side of the first grid's middle
constexpr int kConvexHalf = 8;   // where the height over a plane has one lowest place: the finer grids find it
constexpr int kFineHalf = 4;     // and of each finer one
constexpr double kShrink = 3.0;  // of the spacing from grid to grid
constexpr double kFinest_mm = 2e-4;
constexpr double kMiss = -std::numeric_limits<double>::infinity();

/// Height of the undeformed surface over a place; kMiss beside it.
using Surface = std::function<double(const Eigen::Vector2d& place)>;

Surface surface_of(const GelSpec& gel) {
  if (gel.shape == GelShape::mesh) {
    TS_ASSERT(gel.surface != nullptr);
    return [solid = fem::MeshShape(gel.surface->mesh)](const Eigen::Vector2d& place) {
      const auto down = fem::first_entry(solid, {place.x(), place.y(), 0.0}, -Eigen::Vector3d::UnitZ());
      return down ? -*down : kMiss;
    };
  }
  return [&gel](const Eigen::Vector2d& place) {
    const bool on = gel.shape == GelShape::slab
                        ? std::abs(place.x()) <= 0.5 * gel.size_x_mm && std::abs(place.y()) <= 0.5 * gel.size_y_mm
                    : gel.shape == GelShape::dome ? place.norm() <= gel.base_radius_mm
                                                  : place.norm() <= gel.radius_mm;
    return on ? rest_height(gel, place) : kMiss;
  };
}

}  // namespace

double first_touch(const GelSpec& gel, const fem::ContactShape& shape, const Eigen::Vector2d& place_mm,
                   const Eigen::Matrix3d& rotation) {
  const Surface surface = surface_of(gel);
  const Eigen::Matrix3d object_from_gel = rotation.transpose();
  const Eigen::Vector3d up = object_from_gel.col(2);
  // Of the origin, for the lowest point on the line over this place to touch.
  const auto height_over = [&](const Eigen::Vector2d& place) {
    const double rest = surface(place);
    if (rest == kMiss) return kMiss;
    const Eigen::Vector2d aside = place - place_mm;
    const auto lowest = fem::first_entry(shape, object_from_gel * Eigen::Vector3d(aside.x(), aside.y(), 0.0), up);
    return lowest ? rest - *lowest : kMiss;
  };

  const fem::BoundingBall ball = fem::bounding_ball(shape);
  Eigen::Vector2d middle = place_mm + (rotation * ball.centre).head<2>();
  double best = height_over(middle);
  const bool one_lowest = gel.shape == GelShape::slab && fem::is_convex(shape);
  const int first_half = one_lowest ? kConvexHalf : kHalf;
  double spacing = ball.radius / first_half;
  for (int half = first_half; spacing > kFinest_mm; half = kFineHalf, spacing /= kShrink) {
    const Eigen::Vector2d around = middle;
    for (int j = -half; j <= half; ++j) {
      for (int i = -half; i <= half; ++i) {
        const Eigen::Vector2d place = around + spacing * Eigen::Vector2d(i, j);
        const double height = height_over(place);
        if (height <= best) continue;
        best = height;
        middle = place;
      }
    }
    if (best == kMiss) fail("the object isn't over the gel: place ({}, {}) mm", place_mm.x(), place_mm.y());
  }
  return best;
}

}  // namespace touchstone::sim
