#pragma once

#include <Eigen/Core>
#include <optional>

#include "core/triangle_mesh.h"
#include "fem/mesh/triangle_tree.h"

namespace touchstone::fem {

/// A rigid body bounded by a closed triangle mesh, with the search tree that finds where a line enters it. Object
/// frame, mm.
class MeshShape {
 public:
  /// @throws Error that names the fault if `mesh` doesn't bound a solid (see fault_of_closed_mesh)
  explicit MeshShape(TriangleMesh mesh);

  const TriangleMesh& mesh() const { return mesh_; }

  /// Signed distance from `point` along the unit vector `direction` to the first crossing of the whole line (from minus
  /// infinity) with the surface; nothing if the line misses (see TriangleTree::first_crossing).
  std::optional<double> first_entry(const Eigen::Vector3d& point, const Eigen::Vector3d& direction) const;
  /// Whether the line hits.
  bool is_hit(const Eigen::Vector3d& point, const Eigen::Vector3d& direction) const {
    return tree_.is_crossed(point, direction);
  }

 private:
  TriangleMesh mesh_;
  TriangleTree tree_;
};

}  // namespace touchstone::fem
