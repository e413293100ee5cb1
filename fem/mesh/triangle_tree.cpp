#include "fem/mesh/triangle_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "core/error.h"
#include "fem/mesh/line_hit.h"

namespace touchstone::fem {
namespace {

constexpr int kLeafTriangles = 4;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// One over a direction's components. Across an axis a line is in all of a box's range or in none of it: a number so
/// large says that, too, and never makes a NaN.
Eigen::Vector3d inverse_of(const Eigen::Vector3d& direction) {
  constexpr double kLarge = 1e200;
  return direction.unaryExpr([](double x) { return std::abs(x) > 1.0 / kLarge ? 1.0 / x : kLarge; });
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
  std::vector<int> order(n);
  std::iota(order.begin(), order.end(), 0);
  nodes_.reserve(2 * static_cast<std::size_t>(n) / kLeafTriangles + 2);
  build(order, 0, centroids);
  leaves_.reserve(n);
  for (const int t : order) {
    const auto& v = triangles_[t];
    leaves_.push_back({{vertices_[v[0]], vertices_[v[1]], vertices_[v[2]]}, t});
  }
}

std::array<Eigen::Array3d, 2> TriangleTree::bounds(std::span<const int> some) const {
  Eigen::Array3d low = Eigen::Array3d::Constant(kInfinity);
  Eigen::Array3d high = -low;
  for (const int t : some) {
    for (const int v : triangles_[t]) {
      low = low.min(vertices_[v].array());
      high = high.max(vertices_[v].array());
    }
  }
  return {low, high};
}

/// Of these triangles, which are put in the tree's order; the first of them is number `first` in it.
TriangleTree::Content TriangleTree::build(std::span<int> order, int first,
                                          const std::vector<Eigen::Vector3d>& centroids) {
  const int n = static_cast<int>(order.size());
  if (n <= kLeafTriangles) return {first, n};
  const auto [low, high] = bounds(order);
  int axis = 0;
  (high - low).maxCoeff(&axis);
  const int half = n / 2;
  std::nth_element(order.begin(), order.begin() + half, order.end(), [&](int a, int b) {
    return centroids[a][axis] != centroids[b][axis] ? centroids[a][axis] < centroids[b][axis] : a < b;
  });
  const int node = static_cast<int>(nodes_.size());
  nodes_.emplace_back();
  nodes_[node].axis = axis;
  for (int side = 0; side < 2; ++side) {
    const std::span<int> part = side == 0 ? order.first(half) : order.subspan(half);
    const auto [least, most] = bounds(part);
    // A line through a face of a box must not miss it by rounding.
    const double slack = 1e-12 * (1.0 + std::max(least.abs().maxCoeff(), most.abs().maxCoeff()));
    for (int a = 0; a < 3; ++a) {
      nodes_[node].low[a][side] = least[a] - slack;
      nodes_[node].high[a][side] = most[a] + slack;
    }
    const Content inner = build(part, side == 0 ? first : first + half, centroids);
    nodes_[node].holds[side] = inner;
  }
  return {node, 0};
}

TriangleTree::Hit TriangleTree::nearest(const Eigen::Vector3d& point, const Eigen::Vector3d& direction,
                                        bool any) const {
  const auto [b1, b2] = across(direction);
  const double px = b1.dot(point);
  const double py = b2.dot(point);
  const Eigen::Vector3d inverse = inverse_of(direction);
  Hit nearest;
  nearest.along = kInfinity;
  struct Box {
    double enter;
    Content holds;
  };
  std::array<Box, 64> stack;
  int depth = 0;
  const auto push_node = [&](const Node& node) {
    Eigen::Array2d enter = Eigen::Array2d::Constant(-kInfinity);
    Eigen::Array2d leave = Eigen::Array2d::Constant(nearest.along);
    for (int a = 0; a < 3; ++a) {
      const Eigen::Array2d low = (node.low[a] - point[a]) * inverse[a];
      const Eigen::Array2d high = (node.high[a] - point[a]) * inverse[a];
      enter = enter.max(low.min(high));
      leave = leave.min(low.max(high));
    }
    const int nearer = direction[node.axis] < 0.0 ? 1 : 0;
    for (const int side : {1 - nearer, nearer}) {
      if (enter[side] <= leave[side]) stack[depth++] = {enter[side], node.holds[side]};
    }
  };
  const int all = static_cast<int>(leaves_.size());
  if (all > 0) stack[depth++] = {-kInfinity, nodes_.empty() ? Content{0, all} : Content{0, 0}};
  while (depth > 0) {
    const auto [enter, holds] = stack[--depth];
    if (enter > nearest.along) continue;
    if (holds.count == 0) {
      push_node(nodes_[holds.first]);
      continue;
    }
    for (int k = holds.first; k < holds.first + holds.count; ++k) {
      const std::array<Eigen::Vector3d, 3>& corners = leaves_[k].corners;
      std::array<double, 3> x, y;
      for (int c = 0; c < 3; ++c) {
        x[c] = b1.dot(corners[c]) - px;
        y[c] = b2.dot(corners[c]) - py;
      }
      const auto hit = hit_in(x, y);
      if (!hit) continue;
      const double along = distance_to(*hit, corners, point, direction);
      if (along < nearest.along) nearest = {along, leaves_[k].triangle, hit->areas / hit->sum};
      if (any) return nearest;
    }
  }
  return nearest;
}

std::optional<TriangleTree::Hit> TriangleTree::first_crossing(const Eigen::Vector3d& point,
                                                              const Eigen::Vector3d& direction) const {
  const Hit hit = nearest(point, direction, false);
  if (hit.triangle < 0) return std::nullopt;
  return hit;
}

bool TriangleTree::is_crossed(const Eigen::Vector3d& point, const Eigen::Vector3d& direction) const {
  return nearest(point, direction, true).triangle >= 0;
}

}  // namespace touchstone::fem
