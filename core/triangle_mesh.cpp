#include "core/triangle_mesh.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <tuple>
#include <unordered_map>

#include "core/triangle_crossing.h"

namespace touchstone {
namespace {

// A triangle counts as having no area if its height over the longest side is below this share of that side: rounding.
constexpr double kFlat = 1e-14;

std::string fault_of_vertices(const TriangleMesh& mesh) {
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    if (!mesh.vertices[i].allFinite()) return fmt::format("vertex {} isn't finite", i);
  }
  return {};
}

std::string fault_of_triangles(const TriangleMesh& mesh) {
  if (mesh.triangles.empty()) return "it has no triangles";
  const auto count = static_cast<int>(mesh.vertices.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    for (const int vertex : mesh.triangles[i]) {
      if (vertex < 0 || vertex >= count) {
        return fmt::format("triangle {} names vertex {}, but there are {}", i, vertex, count);
      }
    }
  }
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& t = mesh.triangles[i];
    const Eigen::Vector3d ab = mesh.vertices[t[1]] - mesh.vertices[t[0]];
    const Eigen::Vector3d ac = mesh.vertices[t[2]] - mesh.vertices[t[0]];
    const double longest = std::max({ab.norm(), ac.norm(), (ac - ab).norm()});
    // Divided before the product, so that a tiny mesh doesn't underflow. !(>) also holds for a point, 0/0.
    if (!((ab / longest).cross(ac / longest).norm() > kFlat)) return fmt::format("triangle {} has no area", i);
  }
  return {};
}

std::string fault_of_edges(const TriangleMesh& mesh) {
  struct Edge {
    int low, high, triangle;
    bool upwards;
  };
  std::vector<Edge> edges;
  edges.reserve(3 * mesh.triangles.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      const int from = mesh.triangles[i][k];
      const int to = mesh.triangles[i][(k + 1) % 3];
      edges.push_back({std::min(from, to), std::max(from, to), static_cast<int>(i), from < to});
    }
  }
  std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
    return std::tie(a.low, a.high, a.triangle) < std::tie(b.low, b.high, b.triangle);
  });
  for (std::size_t begin = 0; begin < edges.size();) {
    std::size_t end = begin;
    while (end < edges.size() && edges[end].low == edges[begin].low && edges[end].high == edges[begin].high) ++end;
    const std::size_t owners = end - begin;
    const Edge& edge = edges[begin];
    if (owners == 1) {
      return fmt::format("the edge between vertices {} and {} belongs to 1 triangle: the surface is open", edge.low,
                         edge.high);
    }
    if (owners > 2) {
      return fmt::format("the edge between vertices {} and {} belongs to {} triangles: the surface isn't manifold",
                         edge.low, edge.high, owners);
    }
    if (edge.upwards == edges[begin + 1].upwards) {
      return fmt::format(
          "triangles {} and {}, which share the edge between vertices {} and {}, have opposite orientations",
          edge.triangle, edges[begin + 1].triangle, edge.low, edge.high);
    }
    begin = end;
  }
  return {};
}

}  // namespace

std::string fault_of_closed_mesh(const TriangleMesh& mesh) {
  if (auto fault = fault_of_vertices(mesh); !fault.empty()) return fault;
  if (auto fault = fault_of_triangles(mesh); !fault.empty()) return fault;
  if (auto fault = fault_of_edges(mesh); !fault.empty()) return fault;
  const double volume = enclosed_volume(mesh);
  if (volume < 0.0) return "it is inside out";
  if (!(volume > 0.0 && std::isfinite(volume))) return fmt::format("it encloses a volume of {} mm^3", volume);
  if (const auto crossing = first_crossing(mesh)) {
    return fmt::format("triangles {} and {} cross", crossing->first, crossing->second);
  }
  return {};
}

double enclosed_volume(const TriangleMesh& mesh) {
  if (mesh.vertices.empty()) return 0.0;
  // About a vertex of its own: far from the origin the terms would cancel badly.
  const Eigen::Vector3d origin = mesh.vertices.front();
  double six_volumes = 0.0;
  for (const auto& t : mesh.triangles) {
    six_volumes +=
        (mesh.vertices[t[0]] - origin).dot((mesh.vertices[t[1]] - origin).cross(mesh.vertices[t[2]] - origin));
  }
  return six_volumes / 6.0;
}

std::vector<Eigen::Vector3d> vertex_normals(const TriangleMesh& mesh) {
  std::vector<Eigen::Vector3d> normals(mesh.vertices.size(), Eigen::Vector3d::Zero());
  const auto& p = mesh.vertices;
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3d doubled_area = (p[t[1]] - p[t[0]]).cross(p[t[2]] - p[t[0]]);
    for (const int corner : t) normals[corner] += doubled_area;
  }
  for (Eigen::Vector3d& normal : normals) normal.normalize();  // leaves zero as it is
  return normals;
}

TriangleMesh weld(const TriangleMesh& mesh, double distance, std::vector<int>* kept) {
  if (kept != nullptr) kept->clear();
  // Cells as wide as the distance: what is nearer lies in the same or a neighbouring cell. Cell numbers are doubles,
  // which can't overflow.
  using Cell = std::array<double, 3>;
  struct CellHash {
    std::size_t operator()(const Cell& cell) const {
      std::size_t hash = 0;
      for (const double part : cell) hash = (hash ^ std::hash<double>()(part)) * 0x9e3779b97f4a7c15u;
      return hash ^ (hash >> 29);
    }
  };
  const bool exact = !(distance > 0.0);
  const auto cell_of = [&](const Eigen::Vector3d& point) -> Cell {
    if (exact) return {point.x(), point.y(), point.z()};
    return {std::floor(point.x() / distance), std::floor(point.y() / distance), std::floor(point.z() / distance)};
  };
  const int reach = exact ? 0 : 1;
  std::unordered_map<Cell, std::vector<int>, CellHash> cells;
  std::unordered_map<Cell, int, CellHash> known;  // by its place: most vertices of an STL file stand in it six times
  TriangleMesh welded;
  std::vector<int> new_index(mesh.vertices.size());

  const auto known_near = [&](const Eigen::Vector3d& point, const Cell& cell) -> int {
    int best = -1;
    for (int x = -reach; x <= reach; ++x) {
      for (int y = -reach; y <= reach; ++y) {
        for (int z = -reach; z <= reach; ++z) {
          const auto found = cells.find({cell[0] + x, cell[1] + y, cell[2] + z});
          if (found == cells.end()) continue;
          for (const int candidate : found->second) {
            const double gap = (welded.vertices[candidate] - point).norm();
            if ((exact ? gap == 0.0 : gap < distance) && (best < 0 || candidate < best)) best = candidate;
          }
        }
      }
    }
    return best;
  };
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Eigen::Vector3d& point = mesh.vertices[i];
    const bool finite = point.allFinite();  // what isn't is kept, for fault_of_closed_mesh to find
    if (!finite) {
      new_index[i] = static_cast<int>(welded.vertices.size());
      welded.vertices.push_back(point);
      continue;
    }
    const auto [same, is_new] = known.try_emplace(Cell{point.x(), point.y(), point.z()}, -1);
    if (is_new) {
      const Cell cell = cell_of(point);
      same->second = known_near(point, cell);
      if (same->second < 0) {
        same->second = static_cast<int>(welded.vertices.size());
        welded.vertices.push_back(point);
        cells[cell].push_back(same->second);
      }
    }
    new_index[i] = same->second;
  }
  const auto count = static_cast<int>(mesh.vertices.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    std::array<int, 3> triangle = mesh.triangles[t];
    for (int& vertex : triangle) {
      // An index out of range stays out of range.
      vertex = vertex >= 0 && vertex < count ? new_index[vertex] : std::numeric_limits<int>::max();
    }
    const bool collapsed = triangle[0] == triangle[1] || triangle[1] == triangle[2] || triangle[2] == triangle[0];
    if (!collapsed || triangle[0] == std::numeric_limits<int>::max()) {
      welded.triangles.push_back(triangle);
      if (kept != nullptr) kept->push_back(static_cast<int>(t));
    }
  }
  return welded;
}

}  // namespace touchstone
