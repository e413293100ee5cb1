#include "sim/files/polygon_triangles.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <numeric>

namespace touchstone::sim {
namespace {

/// Twice the area; above 0 if a, b, c run counter-clockwise.
double turn(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  return (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x();
}

/// Seen along the polygon's mean normal, round which it runs counter-clockwise.
std::vector<Eigen::Vector2d> seen_flat(std::span<const Eigen::Vector3d> corners) {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < corners.size(); ++k) {
    normal += (corners[k] - corners[0]).cross(corners[(k + 1) % corners.size()] - corners[0]);
  }
  const Eigen::Vector3d u = normal.normalized().unitOrthogonal();
  const Eigen::Vector3d v = normal.normalized().cross(u);
  std::vector<Eigen::Vector2d> flat;
  for (const Eigen::Vector3d& corner : corners) {
    flat.emplace_back(u.dot(corner - corners[0]), v.dot(corner - corners[0]));
  }
  return flat;
}

}  // namespace

std::vector<std::array<int, 3>> polygon_triangles(std::span<const Eigen::Vector3d> corners) {
  if (corners.size() == 3) return {{0, 1, 2}};
  const std::vector<Eigen::Vector2d> p = seen_flat(corners);
  std::vector<int> left(corners.size());
  std::iota(left.begin(), left.end(), 0);
  std::vector<std::array<int, 3>> triangles;
  while (left.size() > 3) {
    // Of the ears, which are triangles of neighbours with no other corner in them, the one that is least flat.
    std::size_t best = left.size();
    double best_form = 0.0;
    for (std::size_t k = 0; k < left.size(); ++k) {
      const int a = left[(k + left.size() - 1) % left.size()], b = left[k], c = left[(k + 1) % left.size()];
      const double longest = std::max({(p[b] - p[a]).norm(), (p[c] - p[b]).norm(), (p[a] - p[c]).norm()});
      const double form = turn(p[a], p[b], p[c]) / (longest * longest);
      if (!(form > best_form)) continue;
      const bool empty = std::none_of(left.begin(), left.end(), [&](int other) {
        return other != a && other != b && other != c && turn(p[a], p[b], p[other]) >= 0.0 &&
               turn(p[b], p[c], p[other]) >= 0.0 && turn(p[c], p[a], p[other]) >= 0.0;
      });
      if (!empty) continue;
      best = k;
      best_form = form;
    }
    if (best == left.size()) return {};
    triangles.push_back({left[(best + left.size() - 1) % left.size()], left[best], left[(best + 1) % left.size()]});
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(best));
  }
  if (!(turn(p[left[0]], p[left[1]], p[left[2]]) > 0.0)) return {};
  triangles.push_back({left[0], left[1], left[2]});
  return triangles;
}

}  // namespace touchstone::sim
