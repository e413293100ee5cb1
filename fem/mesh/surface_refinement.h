#pragma once

#include <functional>
#include <vector>

#include "core/triangle_mesh.h"
#include "fem/mesh/tet_mesh.h"

namespace touchstone::fem {

/// Bisects edges of a closed surface until none is longer than 1.4 times what `edge` wants at its middle, the one that
/// is longest beside its wish first (so each triangle is cut at its longest edge, and angles don't get smaller than
/// half of what they were [Rivara1984]). Vertices are added at the end and never moved; the pieces keep their
/// triangle's kind. The same input gives the same surface. @pre fault_of_closed_mesh(surface) is empty
void refine_surface(const std::function<double(const Eigen::Vector3d&)>& edge, TriangleMesh& surface,
                    std::vector<FaceKind>& kinds);

}  // namespace touchstone::fem
