#include "sim/press/touch_height.h"

#include <cmath>
#include <limits>

#include "core/error.h"
#include "sim/scene/device_gel.h"

namespace touchstone::sim {
namespace {

constexpr int kHalf = 40;        // lines on either side of the first grid's middle
constexpr int kFineHalf = 4;     // and of each finer one
constexpr double kShrink = 3.0;  // of the spacing from grid to grid
constexpr double kFinest_mm = 2e-4;

bool is_on(const GelSpec& gel, const Eigen::Vector2d& place) {
  switch (gel.shape) {
    case GelShape::slab:
      return std::abs(place.x()) <= 0.5 * gel.size_x_mm && std::abs(place.y()) <= 0.5 * gel.size_y_mm;
    case GelShape::dome:
      return place.norm() <= gel.base_radius_mm;
    case GelShape::fingertip:
      return place.norm() <= gel.radius_mm;
    case GelShape::mesh:
      break;
  }
  fail("a gel of shape mesh has no closed form, so no depth is known over it: give a force or a pose");
}

}  // namespace

double touch_height(const GelSpec& gel, const fem::ContactShape& shape, const Eigen::Vector2d& place_mm,
                    const Eigen::Matrix3d& rotation) {
  const Eigen::Matrix3d object_from_gel = rotation.transpose();
  const Eigen::Vector3d up = object_from_gel.col(2);
  constexpr double kMiss = -std::numeric_limits<double>::infinity();
  // Of the origin, for the lowest point on the line over this place to touch.
  const auto height_over = [&](const Eigen::Vector2d& place) {
    if (!is_on(gel, place)) return kMiss;
    const Eigen::Vector2d aside = place - place_mm;
    const auto lowest = fem::first_entry(shape, object_from_gel * Eigen::Vector3d(aside.x(), aside.y(), 0.0), up);
    return lowest ? rest_height(gel, place) - *lowest : kMiss;
  };

  const fem::BoundingBall ball = fem::bounding_ball(shape);
  Eigen::Vector2d middle = place_mm + (rotation * ball.centre).head<2>();
  double best = height_over(middle);
  double spacing = ball.radius / kHalf;
  for (int half = kHalf; spacing > kFinest_mm; half = kFineHalf, spacing /= kShrink) {
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
