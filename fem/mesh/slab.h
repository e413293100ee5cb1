#pragma once

#include "fem/mesh/tet_mesh.h"

namespace touchstone::fem {

/// A flat slab of gel and how finely to mesh it; all in mm. Gel frame: outer surface z = 0, bonded face z = -thickness,
/// centred in x and y. The box |x| <= fine_half_x, |y| <= fine_half_y, z >= -fine_depth is meshed with edges of `fine`;
/// from there the edges grow with the distance until they are `coarse`.
struct SlabMesh {
  double size_x = 20.0;
  double size_y = 20.0;
  double thickness = 5.0;
  double fine = 0.5;
  double coarse = 1.5;
  double fine_half_x = 4.75;
  double fine_half_y = 4.75;
  double fine_depth = 1.0;
};

/// @throws Error if a size isn't finite and above zero (fine_half_x, fine_half_y and fine_depth may be zero), if fine >
/// coarse, if the slab is over 200 times as wide as thick, or if it would take more than kMostTetrahedra
void check(const SlabMesh& slab);

/// How many tetrahedra mesh_slab will make, within some 40 %: the size field's integral.
double estimated_tetrahedra(const SlabMesh& slab);

/// How many vertices its outer face will have, within some 10 %.
double estimated_surface_vertices(const SlabMesh& slab);

/// Meshes the slab with TetGen 1.5 (constrained Delaunay, refined to a size field). `outer` is the face z = 0, `bonded`
/// the face z = -thickness; the sides are free. Edges are never longer than about the thickness. The same input gives
/// the same mesh. @throws Error as check(), or if TetGen gives up
TetMesh mesh_slab(const SlabMesh& slab);

}  // namespace touchstone::fem
