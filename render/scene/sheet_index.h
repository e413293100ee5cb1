#pragma once
// Where a ray first meets a sheet whose every frame has other triangles.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "render/scene/scene.h"

namespace touchstone::render {

/// On a triangle a b c the place is (1 - u - v) a + u b + v c.
struct SheetHit {
  int triangle;
  double u, v;
  double distance;
};

/// Where a line meets a triangle, or by not more than `beside` of its sides beside it; `distance` may be negative.
std::optional<SheetHit> meet_triangle(const TriangleMesh& mesh, int triangle, const Eigen::Vector3d& origin,
                                      const Eigen::Vector3d& direction, double beside);

/// Normals of a hit: its triangle's, not of unit length, and the one to shade with, as Surface has it.
struct SheetNormals {
  Eigen::Vector3d face, shading;
};
SheetNormals normals_at(const Surface& surface, const SheetHit& hit);  ///< see above

/// The triangles by the cells of a grid over x and y. It's made in a tenth of the time that a ray tree takes, and a
/// camera's rays, which are steep, pass few cells between the sheet's lowest and highest point. Any mesh is right; one
/// of many layers is slow, but one whose triangles all face one side is taken for a height field, as SheetHorizons
/// does. Immutable: many threads may ask.
class SheetIndex {
 public:
  /// The surface must outlive this. What lies beside `seen` (x, y) in all of its height isn't met.
  SheetIndex(const Surface& surface, const Eigen::AlignedBox2d& seen);

  const Surface& surface() const { return surface_; }

  /// The nearest hit ahead of the origin and not beyond `far`. @pre `direction` is a unit vector
  std::optional<SheetHit> first(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double far) const;

 private:
  struct Heights {
    float low, high;
  };

  const Surface& surface_;
  double left_ = 0.0, bottom_ = 0.0, cell_ = 1.0;
  int columns_ = 0, rows_ = 0;
  double low_ = 0.0, high_ = 0.0;  // of all that is in the grid
  double steepest2_ = 0.0;         // square of the largest slope over x and y; infinite where it isn't a height field
  std::vector<int> first_;         // of a cell's triangles, and of the one behind the last
  std::vector<int> triangles_;
  std::vector<Heights> heights_;  // of a cell's triangles
};

}  // namespace touchstone::render
