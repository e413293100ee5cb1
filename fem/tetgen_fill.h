#pragma once
// The one place that calls TetGen 1.5. It aborts the process on NaN, crashes on crossing facets and runs away on nearly
// coincident ones, so callers check what they pass; what comes back is checked here.

#include <Eigen/Core>
#include <array>
#include <functional>
#include <string>
#include <vector>

#include "fem/tet_mesh.h"

namespace touchstone::fem {

/// The boundary of a solid, and how fine to fill it.
struct FillInput {
  struct Facet {
    std::vector<std::vector<int>> polygons;  ///< all in one plane; a polygon of one vertex is a point of the facet
    int marker = 0;
  };
  std::vector<Eigen::Vector3d> points;  ///< mm
  std::vector<Facet> facets;
  bool keep_boundary = false;  ///< no vertex is added on the boundary, whose facets must be triangles
  int most_points = -1;        ///< vertices that may be added; -1: no limit

  /// Wanted length of edges, mm, sampled at the corners of a grid of boxes that must hold all of the solid.
  std::function<double(const Eigen::Vector3d&)> edge;
  std::array<std::vector<double>, 3> grid;  ///< rising planes across x, y, z
};

/// What TetGen made: the input's points first, `outer` and `bonded` still empty.
struct Filling {
  TetMesh mesh;
  std::vector<std::array<int, 3>> faces;  ///< of the boundary, in any sense
  std::vector<int> markers;               ///< of `faces`
};

/// Constrained Delaunay tetrahedra, refined to the wanted edges (radius-edge ratio 1.4 and dihedral angles of 14
/// degrees where the boundary lets them; where slivers below kGoodDihedral are left, other bounds are tried and the
/// best mesh is taken). The same input gives the same mesh. One call at a time: TetGen has globals.
/// @throws Error that begins with `what` if TetGen gives up, or changed a boundary that was to be kept
Filling fill_with_tetrahedra(const FillInput& input, const std::string& what);

/// Planes for FillInput::grid: the solid's ends with a margin beyond, those of its fine part, and some between them.
std::vector<double> graded_planes(double low, double high, double fine_low, double fine_high);

/// Tetrahedra per (mm^3 / edge^3), measured on what TetGen makes of a wanted edge.
inline constexpr double kTetrahedraPerCube = 8.0;

/// More tetrahedra than this are refused before they are made: the elimination would take some 6 GB and a minute.
inline constexpr double kMostTetrahedra = 60000.0;

/// Five degrees, in radians: a mesh without smaller dihedral angles is good.
inline constexpr double kGoodDihedral = 0.0872664625997165;

/// Growth of the wanted edge length per mm away from where it is fine.
inline constexpr double kEdgeGrowth = 0.4;

}  // namespace touchstone::fem
