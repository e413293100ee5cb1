#pragma once
// Where a ray first meets a sheet whose every frame has other triangles.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "render/scene/scene.h"

namespace touchstone::render {

/// The triangles by the cells of a grid over x and y. It's made in a tenth of the time that a ray tree takes, and a
/// camera's rays, which are steep, pass few cells between the sheet's lowest and highest point. Any mesh is right; one
/// of many layers is slow. Immutable: many threads may ask.
class SheetIndex {
 public:
  /// The surface must outlive this. What lies beside `seen` (x, y) in all of its height isn't met.
  SheetIndex(const Surface& surface, const Eigen::AlignedBox2d& seen);

  /// On a triangle a b c the place is (1 - u - v) a + u b + v c.
  struct Hit {
    int triangle;
    double u, v;
    double distance;
  };
  /// The nearest hit ahead of the origin and not beyond `far`. @pre `direction` is a unit vector
  std::optional<Hit> first(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double far) const;

  /// Normals of a hit: its triangle's, not of unit length, and the one to shade with, as Surface has it.
  struct Normals {
    Eigen::Vector3d face, shading;
  };
  Normals normals_at(const Hit& hit) const;  ///< see above

 private:
  struct Heights {
    float low, high;
  };

  const Surface& surface_;
  double left_ = 0.0, bottom_ = 0.0, cell_ = 1.0;
  int columns_ = 0, rows_ = 0;
  double low_ = 0.0, high_ = 0.0;  // of all that is in the grid
  std::vector<int> first_;         // of a cell's triangles, and of the one behind the last
  std::vector<int> triangles_;
  std::vector<Heights> heights_;  // of a cell's triangles
};

}  // namespace touchstone::render
