#pragma once
// The shapes that a gel may have, and their meshes.

#include <variant>
#include <vector>

#include "core/sha256.h"
#include "fem/mesh/revolved_gel.h"
#include "fem/mesh/slab.h"
#include "fem/mesh/solid_gel.h"
#include "fem/mesh/tet_mesh.h"

namespace touchstone::fem {

/// A slab, of which the outermost part may be layers (thicknesses in mm, from the outer surface inwards, within
/// mesh.thickness).
struct SlabGel {
  SlabMesh mesh;
  std::vector<double> layers;
};

/// A gel of any shape; meshes and checks visit it.
using GelBody = std::variant<SlabGel, DomeGel, FingertipGel, SolidGel>;

/// Meshes whose body has a smaller angle between two faces are refused (layers' flat prisms apart).
inline constexpr double kSmallestDihedralDeg = 2.0;

/// Materials that a gel needs: the body's first, then its layers' from the outer surface inwards.
int material_count(const GelBody& body);

/// @throws Error if the body can't be meshed (see the shapes' own check)
void check(const GelBody& body);

/// Depth of the gel under the middle of its outer surface, mm: no press may go deeper.
double thickness_of(const GelBody& body);

/// Edge length where contact is made, and how far from the middle of the outer surface the edges are so fine, mm.
double fine_edge(const GelBody& body);
/// How far from the middle of the outer surface the edges are as long as fine_edge, mm.
double fine_reach(const GelBody& body);

/// Shortest side of a slab, else the thickness, mm.
double least_extent(const GelBody& body);

/// The same gel with all edge lengths multiplied, or with these.
GelBody with_edges(GelBody body, double factor);
GelBody with_edges(GelBody body, double fine, double coarse);

/// How many tetrahedra it will take, within a factor of 2.
double estimated_tetrahedra(const GelBody& body);

/// Its mesh: region 0 is the body, k the k-th layer from outside. The same input gives the same mesh.
/// @throws Error as check(); if a layer is too thin for the edges (add_layers); if TetGen gives up, or makes a body
/// with a dihedral angle below kSmallestDihedralDeg
TetMesh mesh_gel(const GelBody& body);

/// Adds all that the mesh depends on to a checksum. Equal bodies give equal sums (0 and -0 are equal).
void add_to(Sha256& sum, const GelBody& body);

}  // namespace touchstone::fem
