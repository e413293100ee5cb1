#pragma once
// Upright walls that stand round a lit layer on one of its faces: light comes in by what they enclose.

#include <Eigen/Core>
#include <array>
#include <vector>

#include "core/triangle_mesh.h"

namespace touchstone::render {

/// A closed convex outline seen along z, the same at all heights. Nothing within it hides light that has come in
/// through the face between the walls, and what meets the face beyond them is hidden; so to a place within comes
/// whatever is steep enough to meet the face before its line, which is straight seen along z, leaves the outline.
class UprightWalls {
 public:
  UprightWalls() = default;
  /// The walls of a mesh that stand on the level z = `face`; none (empty) where it isn't made of upright triangles only
  /// that form a convex outline, or doesn't reach the face.
  UprightWalls(const TriangleMesh& mesh, double face);

  bool empty() const { return sides_.empty(); }
  /// How far from a place the outline is, mm, along a level unit vector. 0 where it lies behind; of a place beyond
  /// other walls the farther crossing counts, so that the distance is continuous across them.
  double distance(const Eigen::Vector2d& place, const Eigen::Vector2d& heading) const;
  /// How far a place is beyond the outline's lines, mm; within it less than 0.
  double beyond(const Eigen::Vector2d& place) const;
  /// Do all the corners of a triangle lie on one of the walls?
  bool hold(const std::array<Eigen::Vector3d, 3>& corners) const;

 private:
  struct Side {
    Eigen::Vector2d outward;  // unit
    double reach;             // mm: outward . place is that on the wall
  };
  std::vector<Side> sides_;
  double slack_ = 0.0;  // mm
};

}  // namespace touchstone::render
