#include "sim/files/closed_solid.h"

#include <Eigen/Geometry>
#include <cmath>
#include <string>

#include "core/error.h"

namespace touchstone::sim {
namespace {

constexpr double kWeldShare = 1e-6;  // of the diagonal; a float's own step is 1e-7

/// Vertices of no triangle aren't the solid's.
TriangleMesh without_idle_vertices(const TriangleMesh& from) {
  std::vector<int> number(from.vertices.size(), -1);
  for (const auto& triangle : from.triangles) {
    for (const int vertex : triangle) number[static_cast<std::size_t>(vertex)] = 0;
  }
  TriangleMesh mesh;
  mesh.triangles = from.triangles;
  for (std::size_t v = 0; v < from.vertices.size(); ++v) {
    if (number[v] < 0) continue;
    number[v] = static_cast<int>(mesh.vertices.size());
    mesh.vertices.push_back(from.vertices[v]);
  }
  for (auto& triangle : mesh.triangles) {
    for (int& vertex : triangle) vertex = number[static_cast<std::size_t>(vertex)];
  }
  return mesh;
}

}  // namespace

void check_unit(const std::filesystem::path& path, double mm_per_unit) {
  if (mm_per_unit > 0.0 && std::isfinite(mm_per_unit)) return;
  fail("{}: {} mm per unit; allowed is a finite number above 0", path.string(), mm_per_unit);
}

TriangleMesh closed_solid(const TriangleMesh& triangles, const std::filesystem::path& path, std::vector<int>* kept) {
  if (triangles.triangles.empty()) fail("{}: holds no triangles", path.string());
  Eigen::AlignedBox3d box;
  const TriangleMesh used = without_idle_vertices(triangles);
  for (const Eigen::Vector3d& vertex : used.vertices) box.extend(vertex);
  const TriangleMesh mesh = without_idle_vertices(weld(used, kWeldShare * box.diagonal().norm(), kept));
  if (const std::string fault = fault_of_closed_mesh(mesh); !fault.empty()) {
    fail("{}: isn't a closed solid: {}", path.string(), fault);
  }
  return mesh;
}

}  // namespace touchstone::sim
