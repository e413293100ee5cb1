#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>

#include "fem/mesh/tet_mesh.h"

namespace touchstone::lab {

/// The unit cube as cells[0] x cells[1] x cells[2] boxes of six tetrahedra each (Kuhn), its vertices put where `place`
/// says, which must keep every box's sense. Bonded is the cube's face z = 0, outer its face z = 1.
fem::TetMesh block_mesh(const std::array<int, 3>& cells,
                        const std::function<Eigen::Vector3d(const Eigen::Vector3d& in_cube)>& place);

}  // namespace touchstone::lab
