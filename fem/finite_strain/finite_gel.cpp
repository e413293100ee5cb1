#include "fem/finite_strain/finite_gel.h"

#include <cmath>
#include <utility>

#include "core/error.h"

namespace touchstone::fem {

FiniteGel::FiniteGel(TetMesh given, std::span<const ElasticMaterial> materials, std::span<const Bead> beads,
                     double depth)
    : mesh(std::move(given)),
      space(make_space(mesh, materials)),
      problem(space, materials),
      thickness(depth),
      tree(elimination_tree(space)),
      outer(outer_surface(mesh)),
      mass(surface_mass(mesh, outer)),
      coupling(surface_coupling(space, outer)),
      bead_weight(bead_means(space, beads)),
      rest(
          [this] {
            std::vector<Eigen::Vector3d> vertices;
            for (const int v : outer.mesh_vertex) vertices.push_back(mesh.vertices[v]);
            return vertices;
          }(),
          outer.triangles, mass, depth) {
  if (!std::isfinite(thickness) || thickness <= 0.0) {
    fail("the gel's thickness is {} mm; it must be finite and above zero", thickness);
  }
}

}  // namespace touchstone::fem
