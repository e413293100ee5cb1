#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

namespace touchstone::fem {

/// A search tree over triangles, open or closed, that finds where a line first meets them.
class TriangleTree {
 public:
  /// @pre indices in range
  TriangleTree(std::vector<Eigen::Vector3d> vertices, std::vector<std::array<int, 3>> triangles);

  /// Where the line meets a triangle.
  struct Hit {
    double along = 0.0;  ///< signed distance from the point
    int triangle = -1;
    Eigen::Vector3d barycentric = Eigen::Vector3d::Zero();
  };

  /// The first crossing of the whole line (from minus infinity) through `point` along the unit vector `direction`;
  /// nothing if the line misses. A line through an edge or a vertex hits all triangles that share it (edge tests are
  /// inclusive and exactly antisymmetric), so no line slips between two of them.
  std::optional<Hit> first_crossing(const Eigen::Vector3d& point, const Eigen::Vector3d& direction) const;

  const std::vector<Eigen::Vector3d>& vertices() const { return vertices_; }
  const std::vector<std::array<int, 3>>& triangles() const { return triangles_; }

 private:
  /// A box of the tree. Leaves hold triangles [first, first + count); inner nodes have children `first`, `first + 1`.
  struct Node {
    Eigen::Array3d low, high;
    int first = 0;
    int count = 0;
  };
  void build(int node, int begin, int end, const std::vector<Eigen::Vector3d>& centroids);

  std::vector<Eigen::Vector3d> vertices_;
  std::vector<std::array<int, 3>> triangles_;
  std::vector<int> order_;
  std::vector<Node> nodes_;
};

}  // namespace touchstone::fem
