#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "core/triangle_mesh.h"

namespace touchstone::fem {

/// A rigid body bounded by a closed triangle mesh, with the search tree that finds where a line enters it. Object
/// frame, mm.
class MeshShape {
 public:
  /// @throws Error that names the fault if `mesh` doesn't bound a solid (see fault_of_closed_mesh)
  explicit MeshShape(TriangleMesh mesh);

  const TriangleMesh& mesh() const { return mesh_; }

  /// Signed distance from `point` along the unit vector `direction` to the first crossing of the whole line (from minus
  /// infinity) with the surface; nothing if the line misses. A line through an edge or a vertex hits all triangles
  /// that share it (edge tests are inclusive and exactly antisymmetric), so no line slips between two of them.
  std::optional<double> first_entry(const Eigen::Vector3d& point, const Eigen::Vector3d& direction) const;

 private:
  /// A box of the tree. Leaves hold triangles [first, first + count); inner nodes have children `first`, `first + 1`.
  struct Node {
    Eigen::Array3d low, high;
    int first = 0;
    int count = 0;
  };
  void build(int node, int begin, int end, const std::vector<Eigen::Vector3d>& centroids);

  TriangleMesh mesh_;
  std::vector<int> order_;
  std::vector<Node> nodes_;
};

}  // namespace touchstone::fem
