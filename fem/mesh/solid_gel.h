#pragma once

#include <vector>

#include "core/triangle_mesh.h"
#include "fem/mesh/tet_mesh.h"

namespace touchstone::fem {

/// A gel of any shape: a closed triangle surface whose faces are named; all in mm. Gel frame: origin at the middle of
/// the outer surface, +z out of the gel. The box |x| <= fine_half_x, |y| <= fine_half_y, z >= -fine_depth is meshed
/// with edges of `fine`; from there they grow with the distance until they are `coarse`. Triangles are cut smaller as
/// needed and never moved, so the gel is the polyhedron that was given.
struct SolidGel {
  TriangleMesh surface;
  std::vector<FaceKind> faces;  ///< per triangle
  double fine = 0.5;
  double coarse = 1.5;
  double fine_half_x = 4.0;
  double fine_half_y = 4.0;
  double fine_depth = 1.0;
};

/// Surfaces of more triangles are refused.
inline constexpr int kMostSolidTriangles = 20000;
/// Vertices nearer to each other, or to a triangle that isn't theirs, than this part of the fine edge are refused: the
/// elements there would be as small.
inline constexpr double kNearestVertices = 0.01;

/// @throws Error if a length isn't finite and above zero (the fine box's may be zero), the surface isn't a closed solid
/// (fault_of_closed_mesh: open, not manifold, crossing itself, inside out, no volume), vertices nearly coincide, no
/// face is bonded or none outer, or the gel would take more than kMostTetrahedra
void check(const SolidGel& solid);

/// Height of the solid's box, mm.
double thickness_of(const SolidGel& solid);

/// Within a factor of 2, from above: the size field's mean over the solid's box, times the solid's volume.
double estimated_tetrahedra(const SolidGel& solid);

/// @throws Error as check(), or if TetGen gives up or can't keep to kMostTetrahedra
TetMesh mesh_solid(const SolidGel& solid);

}  // namespace touchstone::fem
