#include "sim/press/first_touch.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <vector>

#include "core/error.h"
#include "sim/files/gltf_mesh.h"
#include "sim/scene/device_gel.h"

namespace touchstone::sim {
namespace {

constexpr int kHalf = 40;        // lines on either side of the first grid's middle
constexpr int kFineHalf = 4;     // and of each finer one
constexpr double kShrink = 3.0;  // of the spacing from grid to grid
constexpr double kFinest_mm = 2e-4;
constexpr double kMiss = -std::numeric_limits<double>::infinity();

/// Height of the undeformed surface over a place; kMiss beside it.
using Surface = std::function<double(const Eigen::Vector2d& place)>;

Surface surface_of(const GelSpec& gel) {
  if (const GelMeshSpec* mesh = gel.mesh()) {
    TS_ASSERT(mesh->surface != nullptr);
    return [solid = fem::MeshShape(mesh->surface->mesh)](const Eigen::Vector2d& place) {
      const auto down = fem::first_entry(solid, {place.x(), place.y(), 0.0}, -Eigen::Vector3d::UnitZ());
      return down ? -*down : kMiss;
    };
  }
  if (const SlabSpec* slab = gel.slab()) {
    return [half = Eigen::Array2d(0.5 * slab->size_x_mm, 0.5 * slab->size_y_mm)](const Eigen::Vector2d& place) {
      return (place.array().abs() <= half).all() ? 0.0 : kMiss;
    };
  }
  return [&gel, radius = round_face(gel)->radius_mm](const Eigen::Vector2d& place) {
    return place.norm() <= radius ? rest_height(gel, place) : kMiss;
  };
}

/// The unit vector in the plane z = 0 against this one; zero for zero.
Eigen::Vector3d against(const Eigen::Vector2d& aside) {
  const double length = aside.norm();
  return length > 0.0 ? Eigen::Vector3d(-aside.x() / length, -aside.y() / length, 0.0) : Eigen::Vector3d::Zero();
}

/// The point of a body that lies farthest against the unit vector `up`, object frame; nothing where the shape has no
/// closed form.
std::optional<Eigen::Vector3d> lowest_point(const fem::ContactShape& shape, const Eigen::Vector3d& up) {
  if (std::holds_alternative<fem::SphereShape>(shape)) return -std::get<fem::SphereShape>(shape).radius * up;
  if (const auto* box = std::get_if<fem::BoxShape>(&shape)) {
    const Eigen::Vector3d side(up.x() > 0   ? 1
                               : up.x() < 0 ? -1
                                            : 0,
                               up.y() > 0   ? 1
                               : up.y() < 0 ? -1
                                            : 0,
                               up.z() > 0   ? 1
                               : up.z() < 0 ? -1
                                            : 0);
    return -0.5 * side.cwiseProduct(box->size);
  }
  if (const auto* cylinder = std::get_if<fem::RoundedCylinder>(&shape)) {
    const Eigen::Vector3d outward = against(up.head<2>());
    const double edge = cylinder->edge_radius;
    const Eigen::Vector3d upper = cylinder->radius * outward + cylinder->height * Eigen::Vector3d::UnitZ();
    if (up.z() < 0.0) return upper;
    return (cylinder->radius - edge) * outward + edge * Eigen::Vector3d::UnitZ() - edge * up;
  }
  if (const auto* cone = std::get_if<fem::ConeShape>(&shape)) {
    if (up.z() >= std::sin(cone->half_angle)) return cone->tip_radius * (Eigen::Vector3d::UnitZ() - up);
    return cone->base_radius() * against(up.head<2>()) + cone->height * Eigen::Vector3d::UnitZ();
  }
  if (const auto* torus = std::get_if<fem::TorusShape>(&shape)) {
    const Eigen::Vector3d outward = up.head<2>().norm() > 0.0 ? against(up.head<2>()) : Eigen::Vector3d::UnitX();
    return torus->radius * outward - torus->tube * up;
  }
  if (const auto* bar = std::get_if<fem::BarShape>(&shape)) {
    const double end = up.x() > 0.0 ? -1.0 : up.x() < 0.0 ? 1.0 : 0.0;
    const Eigen::Vector3d side = bar->round_ends ? up : Eigen::Vector3d(0.0, up.y(), up.z()).normalized();
    return end * bar->half_cylinder() * Eigen::Vector3d::UnitX() - bar->radius * side;
  }
  if (const auto* mesh = std::get_if<fem::MeshShape>(&shape)) {
    const std::vector<Eigen::Vector3d>& vertices = mesh->mesh().vertices;
    return *std::min_element(vertices.begin(), vertices.end(),
                             [&](const auto& a, const auto& b) { return up.dot(a) < up.dot(b); });
  }
  return std::nullopt;
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

  if (gel.slab()) {
    // A plane: the body's lowest point touches first, if there is gel below it.
    if (const auto low = lowest_point(shape, up)) {
      const Eigen::Vector2d under = place_mm + (rotation * *low).head<2>();
      if (surface(under) != kMiss) return -up.dot(*low);
    }
  }
  const fem::BoundingBall ball = fem::bounding_ball(shape);
  Eigen::Vector2d middle = place_mm + (rotation * ball.centre).head<2>();
  double best = height_over(middle);
  double spacing = ball.radius / kHalf;
  for (int half = kHalf; spacing > kFinest_mm; half = kFineHalf, spacing /= kShrink) {
    // Again while it pays: along a sharp rim the highest line of a grid may be far from the rim's own highest place.
    for (bool better = true; better; half = kFineHalf) {
      better = false;
      const Eigen::Vector2d around = middle;
      for (int j = -half; j <= half; ++j) {
        for (int i = -half; i <= half; ++i) {
          const Eigen::Vector2d place = around + spacing * Eigen::Vector2d(i, j);
          const double height = height_over(place);
          if (!(height > best)) continue;  // NaN isn't better, else there is no end
          best = height;
          middle = place;
          better = true;
        }
      }
    }
    if (best == kMiss) fail("the object isn't over the gel: place ({}, {}) mm", place_mm.x(), place_mm.y());
  }
  return best;
}

}  // namespace touchstone::sim
