#pragma once

#include <optional>
#include <utility>

#include "core/triangle_mesh.h"

namespace touchstone {

/// Two triangles of the mesh that meet elsewhere than in the vertices or the edge that they share, lower index first;
/// if there are several pairs, always the same one. Touching counts, decided exactly. @pre indices in range, vertices
/// finite, no triangle without area
std::optional<std::pair<int, int>> first_crossing(const TriangleMesh& mesh);

}  // namespace touchstone
