#pragma once
// Gels that are solids of revolution about z: a spherical cap on a cylinder, bonded on its back.

#include <vector>

#include "fem/mesh/tet_mesh.h"

namespace touchstone::fem {

/// A dome; all in mm. Gel frame: apex at the origin, z out of the gel. The outer surface is a cap of a sphere about
/// (0, 0, -sphere_radius), down to where it is base_radius wide; below it stands a cylinder (free sides) down to the
/// bonded disc z = -thickness. With `thickness` as high as the cap itself (0: just that) there is no cylinder.
/// Vertices of the outer surface lie on the sphere, so its triangles run up to edge^2 / (6 sphere_radius) below it.
///
/// Layers lie under the outer surface: their lower faces are concentric spheres. Under a cap alone they end on the base
/// (and are bonded there), above a cylinder on its side. Of a whole hemisphere on a cylinder they run down the sides to
/// the base.
struct DomeGel {
  double sphere_radius = 20.0;
  double base_radius = 8.0;
  double thickness = 0.0;
  double fine = 0.5;    ///< edge length down to fine_depth and up to fine_radius along the surface from the apex
  double coarse = 1.5;  ///< from there edges grow with the distance until they are this long
  double fine_radius = 4.0;
  double fine_depth = 1.0;
  std::vector<double> layers;  ///< thicknesses, from the outside inwards
};

/// A fingertip held in a rigid sleeve; all in mm. Gel frame: apex at the origin, z out of the gel. A hemisphere of
/// `radius` on a cylinder of `length` of the same radius. The back disc z = -(radius + length) is bonded, and so is the
/// part of the cylinder's side within `sleeve` of it; the hemisphere and the rest of the side can be touched. Layers (a
/// skin) follow hemisphere and side down to the back, inside the outline.
struct FingertipGel {
  double radius = 8.0;
  double length = 8.0;
  double sleeve = 6.0;
  double fine = 0.5;
  double coarse = 2.0;
  double fine_radius = 4.0;
  double fine_depth = 1.0;
  std::vector<double> layers;
};

/// @throws Error if a length isn't finite and above zero (those of the fine part, and thickness, length and sleeve, may
/// be zero), the base is wider than the sphere or the cap higher than thick, the cylinder under a cap is lower than
/// half a fine edge, the cap's rim is sharper than kSharpestRim, the sleeve longer than the cylinder, layers take all
/// of the gel, or the gel would take more than kMostTetrahedra
void check(const DomeGel& dome);
void check(const FingertipGel& fingertip);

/// A cap without a cylinder must meet its base at 15 degrees or more (radians).
inline constexpr double kSharpestRim = 0.2617993877991494;

/// Depth of the bonded back under the apex, mm.
double thickness_of(const DomeGel& dome);
double thickness_of(const FingertipGel& fingertip);

/// How many tetrahedra the mesh will have, within a factor of 1.6.
double estimated_tetrahedra(const DomeGel& dome);
double estimated_tetrahedra(const FingertipGel& fingertip);

/// Rings of triangles on the surface, TetGen inside them, flat prisms for the layers. Six-fold symmetric on the
/// outside.
/// @throws Error as check(), for a layer that is too thin (add_layers), or if TetGen gives up
TetMesh mesh_revolved(const DomeGel& dome);
TetMesh mesh_revolved(const FingertipGel& fingertip);

}  // namespace touchstone::fem
