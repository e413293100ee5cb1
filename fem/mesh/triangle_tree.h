#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <span>
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
  /// Whether the line crosses any triangle.
  bool is_crossed(const Eigen::Vector3d& point, const Eigen::Vector3d& direction) const;

  const std::vector<Eigen::Vector3d>& vertices() const { return vertices_; }
  const std::vector<std::array<int, 3>>& triangles() const { return triangles_; }

 private:
  /// What a box holds: the triangles [first, first + count), or, with a count of 0, the node `first`.
  struct Content {
    int first = 0;
    int count = 0;
  };
  struct Leaf {
    std::array<Eigen::Vector3d, 3> corners;
    int triangle = 0;
  };
  /// Two boxes, tested together. The second is farther along `axis`.
  struct Node {
    std::array<Eigen::Array2d, 3> low, high;  ///< per axis
    std::array<Content, 2> holds;
    int axis = 0;
  };
  Hit nearest(const Eigen::Vector3d& point, const Eigen::Vector3d& direction, bool any) const;
  Content build(std::span<int> order, int first, const std::vector<Eigen::Vector3d>& centroids);
  std::array<Eigen::Array3d, 2> bounds(std::span<const int> some) const;

  std::vector<Eigen::Vector3d> vertices_;
  std::vector<std::array<int, 3>> triangles_;
  std::vector<Leaf> leaves_;  ///< in the tree's order
  std::vector<Node> nodes_;   ///< from the root on; none: all triangles are one leaf's
};

}  // namespace touchstone::fem
