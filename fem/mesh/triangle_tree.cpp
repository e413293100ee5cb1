#include "fem/mesh/triangle_tree.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "core/error.h"

namespace touchstone::fem {
namespace {

constexpr int kLeafTriangles = 4;

/// The part of a line inside a box, as an interval of the line's parameter; empty if first > second.
std::pair<double, double> slab_interval(const Eigen::Array3d& low, const Eigen::Array3d& high,
                                        const Eigen::Vector3d& point, const Eigen::Vector3d& direction) {
  double enter = -std::numeric_limits<double>::infinity();
  double leave = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    if (direction[axis] == 0.0) {
      if (point[axis] < low[axis] || point[axis] > high[axis]) return {1.0, 0.0};
      continue;
    }
    double a = (low[axis] - point[axis]) / direction[axis];
    double b = (high[axis] - point[axis]) / direction[axis];
    if (a > b) std::swap(a, b);
    enter = std::max(enter, a);
    leave = std::min(leave, b);
  }
  return {enter, leave};
}

/// Two unit vectors across `direction`.
std::pair<Eigen::Vector3d, Eigen::Vector3d> across(const Eigen::Vector3d& direction) {
  int smallest = 0;
  direction.cwiseAbs().minCoeff(&smallest);
  const Eigen::Vector3d first = direction.cross(Eigen::Vector3d::Unit(smallest)).normalized();
  return {first, direction.cross(first)};
}

}  // namespace

TriangleTree::TriangleTree(std::vector<Eigen::Vector3d> vertices, std::vector<std::array<int, 3>> triangles)
    : vertices_(std::move(vertices)), triangles_(std::move(triangles)) {
  const int n = static_cast<int>(triangles_.size());
  std::vector<Eigen::Vector3d> centroids(n);
  for (int t = 0; t < n; ++t) {
    const auto& v = triangles_[t];
    for (const int corner : v) TS_ASSERT(corner >= 0 && corner < static_cast<int>(vertices_.size()));
    centroids[t] = (vertices_[v[0]] + vertices_[v[1]] + vertices_[v[2]]) / 3.0;
  }
  order_.resize(n);
  std::iota(order_.begin(), order_.end(), 0);
  nodes_.reserve(2 * static_cast<std::size_t>(n) / kLeafTriangles + 2);
  nodes_.emplace_back();
  build(0, 0, n, centroids);
}

void TriangleTree::build(int node, int begin, int end, const std::vector<Eigen::Vector3d>& centroids) {
  Eigen::Array3d low = Eigen::Array3d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Array3d high = -low;
  for (int k = begin; k < end; ++k) {
    for (const int v : triangles_[order_[k]]) {
      low = low.min(vertices_[v].array());
      high = high.max(vertices_[v].array());
    }
  }
  // A line through a face of a box must not miss it by rounding.
  const double slack = 1e-12 * (1.0 + std::max(low.abs().maxCoeff(), high.abs().maxCoeff()));
  nodes_[node].low = low - slack;
  nodes_[node].high = high + slack;
  if (end - begin <= kLeafTriangles) {
    nodes_[node].first = begin;
    nodes_[node].count = end - begin;
    return;
  }
  int axis = 0;
  (high - low).maxCoeff(&axis);
  const int middle = begin + (end - begin) / 2;
  std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end, [&](int a, int b) {
    return centroids[a][axis] != centroids[b][axis] ? centroids[a][axis] < centroids[b][axis] : a < b;
  });
  const int child = static_cast<int>(nodes_.size());
  nodes_[node].first = child;
  nodes_.emplace_back();
  nodes_.emplace_back();
  build(child, begin, middle, centroids);
  build(child + 1, middle, end, centroids);
}

std::optional<TriangleTree::Hit> TriangleTree::first_crossing(const Eigen::Vector3d& point,
                                                              const Eigen::Vector3d& direction) const {
  const auto [b1, b2] = across(direction);
  const double px = b1.dot(point);
  const double py = b2.dot(point);
  Hit nearest;
  nearest.along = std::numeric_limits<double>::infinity();
  std::array<int, 64> stack;
  int depth = 0;
  stack[depth++] = 0;
  while (depth > 0) {
    const Node& node = nodes_[stack[--depth]];
    const auto [enter, leave] = slab_interval(node.low, node.high, point, direction);
    if (enter > leave || enter > nearest.along) continue;
    if (node.count == 0) {
      stack[depth++] = node.first;
      stack[depth++] = node.first + 1;
      continue;
    }
    for (int k = node.first; k < node.first + node.count; ++k) {
      const auto& t = triangles_[order_[k]];
      std::array<double, 3> x, y;
      for (int c = 0; c < 3; ++c) {
        x[c] = b1.dot(vertices_[t[c]]) - px;
        y[c] = b2.dot(vertices_[t[c]]) - py;
      }
      const double e0 = x[1] * y[2] - y[1] * x[2];
      const double e1 = x[2] * y[0] - y[2] * x[0];
      const double e2 = x[0] * y[1] - y[0] * x[1];
      const bool inside = (e0 >= 0 && e1 >= 0 && e2 >= 0) || (e0 <= 0 && e1 <= 0 && e2 <= 0);
      const double sum = e0 + e1 + e2;
      if (!inside || sum == 0.0) continue;  // seen edge-on: its neighbours are hit
      const double along = (e0 * direction.dot(vertices_[t[0]] - point) + e1 * direction.dot(vertices_[t[1]] - point) +
                            e2 * direction.dot(vertices_[t[2]] - point)) /
                           sum;
      if (along < nearest.along) nearest = {along, order_[k], Eigen::Vector3d(e0, e1, e2) / sum};
    }
  }
  if (nearest.triangle < 0) return std::nullopt;
  return nearest;
}

}  // namespace touchstone::fem
