#include "fem/contact/tip_gap.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace touchstone::fem {
namespace {

/// The corner that is farthest along `down`, object frame.
template <typename Shape>
std::optional<Eigen::Vector3d> corner(const Shape&, const Eigen::Vector3d&) {
  return std::nullopt;
}
std::optional<Eigen::Vector3d> corner(const ConeShape& cone, const Eigen::Vector3d& down) {
  return Eigen::Vector3d(0.0, 0.0, down.z() <= 0.0 ? 0.0 : cone.height);
}
std::optional<Eigen::Vector3d> corner(const RoundedCylinder& cylinder, const Eigen::Vector3d& down) {
  return Eigen::Vector3d(0.0, 0.0, down.z() <= 0.0 ? 0.0 : cylinder.height);
}
std::optional<Eigen::Vector3d> corner(const BarShape& bar, const Eigen::Vector3d& down) {
  return Eigen::Vector3d(std::copysign(0.5 * bar.length, down.x()), 0.0, 0.0);
}
std::optional<Eigen::Vector3d> corner(const BoxShape& box, const Eigen::Vector3d& down) {
  Eigen::Vector3d result;
  for (int a = 0; a < 3; ++a) result[a] = std::copysign(0.5 * box.size[a], down[a]);
  return result;
}
std::optional<Eigen::Vector3d> corner(const MeshShape& shape, const Eigen::Vector3d& down) {
  const auto& vertices = shape.mesh().vertices;
  return *std::max_element(vertices.begin(), vertices.end(), [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return a.dot(down) < b.dot(down);
  });
}

}  // namespace

double tip_gap(const ContactSurface& surface, const ContactShape& shape, const RigidTransform& gel_from_object) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const Eigen::Vector3d down = gel_from_object.rotation.transpose() * Eigen::Vector3d(0.0, 0.0, -1.0);
  const auto tip = std::visit([&](const auto& body) { return corner(body, down); }, shape);
  if (!tip) return kInfinity;
  const Eigen::Vector3d point = gel_from_object * *tip;
  double gap = kInfinity;
  for (const auto& t : surface.triangles) {
    const Eigen::Vector3d& a = surface.vertices[t[0]];
    const Eigen::Vector3d u = surface.vertices[t[1]] - a;
    const Eigen::Vector3d v = surface.vertices[t[2]] - a;
    const Eigen::Vector3d normal = u.cross(v);
    const double twice_area2 = normal.squaredNorm();
    const Eigen::Vector3d from = point - a;
    const double at_u = from.cross(v).dot(normal) / twice_area2;
    const double at_v = u.cross(from).dot(normal) / twice_area2;
    if (at_u < 0.0 || at_v < 0.0 || at_u + at_v > 1.0) continue;
    const double height = from.dot(normal) / std::sqrt(twice_area2);
    if (height < -surface.farthest_behind) continue;
    if (std::abs(height) < std::abs(gap)) gap = height;
  }
  return gap;
}

}  // namespace touchstone::fem
