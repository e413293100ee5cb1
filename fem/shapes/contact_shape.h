#pragma once
// Rigid bodies that touch the gel, each in its own object frame (mm).

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <variant>

#include "fem/shapes/bar_shape.h"
#include "fem/shapes/cone_shape.h"
#include "fem/shapes/egg_shape.h"
#include "fem/shapes/mesh_shape.h"
#include "fem/shapes/relief_map.h"
#include "fem/shapes/shell_shape.h"
#include "fem/shapes/torus_shape.h"

namespace touchstone::fem {

/// A ball centred at the origin.
struct SphereShape {
  double radius = 1.0;
};

/// A cylinder about the z axis: flat face in the plane z = 0, body at 0 <= z <= height. The rim of the face z = 0 is a
/// quarter torus of `edge_radius` (0: a sharp edge); the other rim is sharp.
struct RoundedCylinder {
  double radius = 1.0;
  double edge_radius = 0.0;
  double height = 1.0;
};

/// A box centred at the origin, `size` being its whole edge lengths.
struct BoxShape {
  Eigen::Vector3d size = Eigen::Vector3d::Ones();
};

/// The shapes that a relief may lie on.
using PlainShape = std::variant<SphereShape, RoundedCylinder, BoxShape, MeshShape, EggShape, ShellShape, ConeShape,
                                TorusShape, BarShape>;

/// A body whose lower side bears a relief: at each (x, y) of the object frame the surface that faces -z lies lower
/// than the plain body's by the map's height. Lines that run up (direction.z > 0) meet the relief; others the plain
/// body. Tilted lines are followed by a fixed point: right where the relief's slope times the tangent of the tilt is
/// below one.
struct ReliefShape {
  PlainShape base;
  std::shared_ptr<const ReliefMap> relief;
};

/// Any shape: a plain one, or one with relief.
using ContactShape = std::variant<SphereShape, RoundedCylinder, BoxShape, MeshShape, EggShape, ShellShape, ConeShape,
                                  TorusShape, BarShape, ReliefShape>;

/// Whether the gap over a plane is convex wherever the body stands.
bool is_convex(const ContactShape& shape);

/// Refuses sizes that aren't finite and positive, and those that don't go together: an edge radius above the cylinder's
/// radius or height, a cone lower than its rounded tip, a tube as wide as its ring, a capsule shorter than wide.
/// @throws Error
void check_shape(const ContactShape& shape);

/// Signed distance along the line from `point` (object frame) in the unit direction `direction` to where the line first
/// enters the body, searching from minus infinity; nothing if the line misses. A line that touches counts as a hit.
std::optional<double> first_entry(const SphereShape& shape, const Eigen::Vector3d& point,
                                  const Eigen::Vector3d& direction);
std::optional<double> first_entry(const RoundedCylinder& shape, const Eigen::Vector3d& point,
                                  const Eigen::Vector3d& direction);
std::optional<double> first_entry(const BoxShape& shape, const Eigen::Vector3d& point,
                                  const Eigen::Vector3d& direction);
std::optional<double> first_entry(const MeshShape& shape, const Eigen::Vector3d& point,
                                  const Eigen::Vector3d& direction);
std::optional<double> first_entry(const ReliefShape& shape, const Eigen::Vector3d& point,
                                  const Eigen::Vector3d& direction);
std::optional<double> first_entry(const ContactShape& shape, const Eigen::Vector3d& point,
                                  const Eigen::Vector3d& direction);

/// Whether the line hits: whether first_entry() has an answer, for less where that takes a search.
bool is_hit(const RoundedCylinder& shape, const Eigen::Vector3d& point, const Eigen::Vector3d& direction);
bool is_hit(const MeshShape& shape, const Eigen::Vector3d& point, const Eigen::Vector3d& direction);
bool is_hit(const ReliefShape& shape, const Eigen::Vector3d& point, const Eigen::Vector3d& direction);
template <typename Shape>
bool is_hit(const Shape& shape, const Eigen::Vector3d& point, const Eigen::Vector3d& direction) {
  return first_entry(shape, point, direction).has_value();
}

/// How far inside the body's silhouette the line lies: the signed distance, across the direction, from the line to the
/// silhouette's outline, positive where the line hits; outside a corner, and where its shape says so, it may be less
/// than the distance. Nothing where there is no closed form for this direction. Continuous in `point`.
std::optional<double> silhouette_distance(const SphereShape& shape, const Eigen::Vector3d& point,
                                          const Eigen::Vector3d& direction);
std::optional<double> silhouette_distance(const RoundedCylinder& shape, const Eigen::Vector3d& point,
                                          const Eigen::Vector3d& direction);
std::optional<double> silhouette_distance(const BoxShape& shape, const Eigen::Vector3d& point,
                                          const Eigen::Vector3d& direction);
std::optional<double> silhouette_distance(const MeshShape& shape, const Eigen::Vector3d& point,
                                          const Eigen::Vector3d& direction);
std::optional<double> silhouette_distance(const ReliefShape& shape, const Eigen::Vector3d& point,
                                          const Eigen::Vector3d& direction);

/// A ball that holds the whole body: centre in the object frame and radius.
struct BoundingBall {
  Eigen::Vector3d centre;
  double radius;
};
/// Of the shape with its relief; not the smallest one for every shape.
BoundingBall bounding_ball(const ContactShape& shape);

}  // namespace touchstone::fem
