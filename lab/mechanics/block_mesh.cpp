#include "lab/mechanics/block_mesh.h"

#include <algorithm>
#include <utility>

namespace touchstone::lab {

fem::TetMesh block_mesh(const std::array<int, 3>& cells,
                        const std::function<Eigen::Vector3d(const Eigen::Vector3d& in_cube)>& place) {
  fem::TetMesh mesh;
  const auto index = [&](const std::array<int, 3>& at) {
    return (at[2] * (cells[1] + 1) + at[1]) * (cells[0] + 1) + at[0];
  };
  const auto each_box = [&](int beyond, const auto& act) {
    for (int k = 0; k < cells[2] + beyond; ++k) {
      for (int j = 0; j < cells[1] + beyond; ++j) {
        for (int i = 0; i < cells[0] + beyond; ++i) act(std::array<int, 3>{i, j, k});
      }
    }
  };
  std::vector<int> level;  // of each vertex
  each_box(1, [&](const std::array<int, 3>& at) {
    mesh.vertices.push_back(place({static_cast<double>(at[0]) / cells[0], static_cast<double>(at[1]) / cells[1],
                                   static_cast<double>(at[2]) / cells[2]}));
    level.push_back(at[2]);
  });
  constexpr std::array<std::array<int, 3>, 6> kOrders = {
      {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}}};
  each_box(0, [&](const std::array<int, 3>& from) {
    for (const auto& order : kOrders) {
      std::array<int, 3> corner = from;
      std::array<int, 4> tetrahedron = {index(from), 0, 0, 0};
      for (int step = 0; step < 3; ++step) {
        ++corner[order[step]];
        tetrahedron[step + 1] = index(corner);
      }
      if (fem::volume(mesh, tetrahedron) < 0.0) std::swap(tetrahedron[2], tetrahedron[3]);
      mesh.tetrahedra.push_back(tetrahedron);
    }
  });
  for (const auto& face : fem::boundary_faces(mesh)) {
    const auto all_at = [&](int wanted) {
      return std::all_of(face.begin(), face.end(), [&](int v) { return level[v] == wanted; });
    };
    if (all_at(cells[2])) mesh.outer.push_back(face);
    if (all_at(0)) mesh.bonded.push_back(face);
  }
  return mesh;
}

}  // namespace touchstone::lab
