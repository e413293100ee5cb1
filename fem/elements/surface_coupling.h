#pragma once
// The border of the elastic system: what is asked of the displacement, as rows over the nodes of the Taylor-Hood space.

#include <Eigen/SparseCore>
#include <array>
#include <span>
#include <vector>

#include "fem/elements/compliance.h"
#include "fem/elements/taylor_hood.h"

namespace touchstone::fem {

/// The outer surface by itself: its vertices in the mesh's order.
struct OuterSurface {
  std::vector<int> mesh_vertex;               ///< vertex of the mesh under each vertex of the surface
  std::vector<std::array<int, 3>> triangles;  ///< over the surface's vertices
};
/// Made from the faces TetMesh::outer.
OuterSurface outer_surface(const TetMesh& mesh);

/// n x n: int phi_i phi_j dA over the surface, mm^2.
Eigen::SparseMatrix<double> surface_mass(const TetMesh& mesh, const OuterSurface& surface);

/// n x nodes: int phi_i N_k dA over the surface, mm^2, with phi the linear and N the quadratic functions. Exact.
Eigen::SparseMatrix<double> surface_coupling(const TaylorHoodSpace& space, const OuterSurface& surface);

/// m x nodes: weights of the mean over each bead's surface.
/// @throws Error if a bead isn't wholly inside the gel
Eigen::SparseMatrix<double> bead_means(const TaylorHoodSpace& space, std::span<const Bead> beads);

}  // namespace touchstone::fem
