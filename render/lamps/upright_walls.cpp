#include "render/lamps/upright_walls.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace touchstone::render {
namespace {

constexpr double kOnFace_mm = 1e-3;
constexpr double kRounding = 1e-9;  // of the walls' size

double turn(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

/// The corners of the convex hull, counter-clockwise: the lower and the upper chain, each from left to right of the
/// points in order.
std::vector<Eigen::Vector2d> convex_hull(std::vector<Eigen::Vector2d> points) {
  std::ranges::sort(points,
                    [](const auto& a, const auto& b) { return std::pair(a.x(), a.y()) < std::pair(b.x(), b.y()); });
  std::vector<Eigen::Vector2d> hull;
  for (int chain = 0; chain < 2; ++chain) {
    const std::size_t first = hull.size();
    for (const Eigen::Vector2d& point : points) {
      while (hull.size() >= first + 2 && !(turn(hull[hull.size() - 2], hull.back(), point) > 0.0)) hull.pop_back();
      hull.push_back(point);
    }
    hull.pop_back();  // the other chain's first
    std::ranges::reverse(points);
  }
  return hull;
}

}  // namespace

UprightWalls::UprightWalls(const TriangleMesh& mesh, double face) {
  if (mesh.triangles.empty()) return;
  std::vector<Eigen::Vector2d> points;
  double off_face = std::numeric_limits<double>::infinity();
  double size = 0.0;
  for (const auto& triangle : mesh.triangles) {
    for (const int corner : triangle) {
      const Eigen::Vector3d& vertex = mesh.vertices[static_cast<std::size_t>(corner)];
      points.emplace_back(vertex.head<2>());
      off_face = std::min(off_face, std::abs(vertex.z() - face));
      size = std::max(size, vertex.head<2>().norm());
    }
  }
  slack_ = kRounding * size;
  if (!(off_face <= kOnFace_mm)) return;
  const std::vector<Eigen::Vector2d> hull = convex_hull(std::move(points));
  for (std::size_t k = 0; k < hull.size(); ++k) {
    const Eigen::Vector2d along = hull[(k + 1) % hull.size()] - hull[k];
    if (!(along.norm() > slack_)) continue;
    const Eigen::Vector2d outward = Eigen::Vector2d(along.y(), -along.x()).normalized();
    sides_.push_back({outward, outward.dot(hull[k])});
  }
  const bool upright = std::ranges::all_of(mesh.triangles, [&](const std::array<int, 3>& t) {
    return hold({mesh.vertices[static_cast<std::size_t>(t[0])], mesh.vertices[static_cast<std::size_t>(t[1])],
                 mesh.vertices[static_cast<std::size_t>(t[2])]});
  });
  if (sides_.size() < 3 || !upright) sides_.clear();
}

double UprightWalls::distance(const Eigen::Vector2d& place, const Eigen::Vector2d& heading) const {
  double nearest = std::numeric_limits<double>::infinity();
  for (const Side& side : sides_) {
    const double towards = side.outward.dot(heading);
    if (towards > 0.0) nearest = std::min(nearest, (side.reach - side.outward.dot(place)) / towards);
  }
  return std::max(0.0, nearest);
}

double UprightWalls::beyond(const Eigen::Vector2d& place) const {
  double most = -std::numeric_limits<double>::infinity();
  for (const Side& side : sides_) most = std::max(most, side.outward.dot(place) - side.reach);
  return most;
}

bool UprightWalls::hold(const std::array<Eigen::Vector3d, 3>& corners) const {
  return std::ranges::any_of(sides_, [&](const Side& side) {
    return std::ranges::all_of(corners, [&](const Eigen::Vector3d& corner) {
      return std::abs(side.outward.dot(corner.head<2>()) - side.reach) <= slack_;
    });
  });
}

}  // namespace touchstone::render
