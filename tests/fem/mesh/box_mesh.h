#pragma once

#include <Eigen/Core>
#include <array>
#include <utility>

#include "fem/mesh/tet_mesh.h"

namespace touchstone::fem::fixtures {

/// The box |x| <= size_x/2, |y| <= size_y/2, -size_z <= z <= 0 as nx * ny * nz boxes of six tetrahedra each. Inner
/// vertices are pushed by up to `unevenness` times the spacing, each in its own direction, so that nothing is right by
/// symmetry.
inline TetMesh box_mesh(const Eigen::Vector3d& size, int nx, int ny, int nz, double unevenness = 0.0) {
  TetMesh mesh;
  const std::array<int, 3> cells = {nx, ny, nz};
  const auto index = [&](int i, int j, int k) { return (k * (ny + 1) + j) * (nx + 1) + i; };
  for (int k = 0; k <= nz; ++k) {
    for (int j = 0; j <= ny; ++j) {
      for (int i = 0; i <= nx; ++i) {
        const std::array<int, 3> at = {i, j, k};
        Eigen::Vector3d x;
        for (int a = 0; a < 3; ++a) {
          const double push = (((i * 7 + j * 13 + k * 29) * (a + 3) + a) % 11) / 5.0 - 1.0;
          const bool inner = at[a] > 0 && at[a] < cells[a];
          x[a] = size[a] * ((at[a] + (inner ? unevenness * push : 0.0)) / cells[a] - (a == 2 ? 1.0 : 0.5));
        }
        if (k == nz) {
          x.z() = 0.0;
        }
        mesh.vertices.push_back(x);
      }
    }
  }
  constexpr int kOrders[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
  for (int k = 0; k < nz; ++k) {
    for (int j = 0; j < ny; ++j) {
      for (int i = 0; i < nx; ++i) {
        for (const auto& order : kOrders) {
          std::array<int, 3> at = {i, j, k};
          std::array<int, 4> corners{};
          corners[0] = index(i, j, k);
          for (int step = 0; step < 3; ++step) {
            ++at[order[step]];
            corners[step + 1] = index(at[0], at[1], at[2]);
          }
          if (volume(mesh, corners) < 0.0) {
            std::swap(corners[2], corners[3]);
          }
          mesh.tetrahedra.push_back(corners);
        }
      }
    }
  }
  for (const auto& face : boundary_faces(mesh)) {
    const auto level = [&](double z) {
      return mesh.vertices[face[0]].z() == z && mesh.vertices[face[1]].z() == z && mesh.vertices[face[2]].z() == z;
    };
    if (level(0.0)) {
      mesh.outer.push_back(face);
    } else if (level(-size.z())) {
      mesh.bonded.push_back(face);
    }
  }
  return mesh;
}

}  // namespace touchstone::fem::fixtures
