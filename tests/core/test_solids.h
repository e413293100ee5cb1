#pragma once
// Solids that tests of meshes start from.

#include <Eigen/Geometry>
#include <cmath>
#include <utility>

#include "core/transform.h"
#include "core/triangle_mesh.h"
#include "core/units.h"

namespace touchstone {

// A cube [0,1]^3 whose faces are n x n squares of two triangles; vertices of neighbouring faces are split.
inline TriangleMesh split_cube(int n) {
  TriangleMesh mesh;
  for (int axis = 0; axis < 3; ++axis) {
    for (int side = 0; side < 2; ++side) {
      const auto base = static_cast<int>(mesh.vertices.size());
      for (int j = 0; j <= n; ++j) {
        for (int i = 0; i <= n; ++i) {
          Eigen::Vector3d p;
          p[axis] = side;
          p[(axis + 1) % 3] = static_cast<double>(i) / n;
          p[(axis + 2) % 3] = static_cast<double>(j) / n;
          mesh.vertices.push_back(p);
        }
      }
      for (int j = 0; j < n; ++j) {
        for (int i = 0; i < n; ++i) {
          const int a = base + j * (n + 1) + i;
          const int c = a + n + 2;
          std::array<int, 3> one = {a, a + 1, c};
          std::array<int, 3> other = {a, c, c - 1};
          if (side == 0) {
            std::swap(one[1], one[2]);
            std::swap(other[1], other[2]);
          }
          mesh.triangles.push_back(one);
          mesh.triangles.push_back(other);
        }
      }
    }
  }
  return mesh;
}

inline TriangleMesh cube(int n = 1) {
  return weld(split_cube(n), 1e-9);
}

inline TriangleMesh sphere(int rings, int sectors, double radius = 1.0) {
  TriangleMesh mesh;
  mesh.vertices.emplace_back(0, 0, radius);
  for (int i = 1; i < rings; ++i) {
    for (int j = 0; j < sectors; ++j) {
      const double theta = kPi * i / rings;
      const double phi = 2.0 * kPi * j / sectors;
      mesh.vertices.emplace_back(radius * std::sin(theta) * std::cos(phi), radius * std::sin(theta) * std::sin(phi),
                                 radius * std::cos(theta));
    }
  }
  mesh.vertices.emplace_back(0, 0, -radius);
  const auto at = [&](int i, int j) {
    if (i == 0) return 0;
    if (i == rings) return static_cast<int>(mesh.vertices.size()) - 1;
    return 1 + (i - 1) * sectors + j % sectors;
  };
  for (int i = 0; i < rings; ++i) {
    for (int j = 0; j < sectors; ++j) {
      if (i > 0) mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i, j + 1)});
      if (i + 1 < rings) mesh.triangles.push_back({at(i, j + 1), at(i + 1, j), at(i + 1, j + 1)});
    }
  }
  return mesh;
}

inline TriangleMesh moved(TriangleMesh mesh, const RigidTransform& transform) {
  for (Eigen::Vector3d& vertex : mesh.vertices) vertex = transform * vertex;
  return mesh;
}

inline TriangleMesh shifted(TriangleMesh mesh, const Eigen::Vector3d& by) {
  return moved(std::move(mesh), {.translation = by});
}

inline TriangleMesh turned_inside_out(TriangleMesh mesh) {
  for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
  return mesh;
}

inline TriangleMesh both(const TriangleMesh& a, const TriangleMesh& b) {
  TriangleMesh mesh = a;
  mesh.vertices.insert(mesh.vertices.end(), b.vertices.begin(), b.vertices.end());
  const auto offset = static_cast<int>(a.vertices.size());
  for (const auto& t : b.triangles) mesh.triangles.push_back({t[0] + offset, t[1] + offset, t[2] + offset});
  return mesh;
}

}  // namespace touchstone
