#pragma once
// The one place that calls TetGen 1.5. It aborts on NaN, crashes on crossing facets, runs away on nearly coincident
// ones and now and then fails an assertion of its own on sound input. So callers check what they pass, TetGen runs in a
// process of its own, and what comes back is checked here.

#include <Eigen/Core>
#include <array>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "fem/mesh/tet_mesh.h"

namespace touchstone::fem {

/// The boundary of a solid, and how fine to fill it.
struct FillInput {
  /// Polygons that all lie in one plane; one of a single vertex is a point of the facet.
  using Facet = std::vector<std::vector<int>>;
  std::vector<Eigen::Vector3d> points;  ///< mm
  std::vector<Facet> facets;
  /// No vertex is added on the boundary, whose facets must be triangles. Without it, facets that nearly but not quite
  /// lie in one plane can bring TetGen to an assertion, which ends the process (5 of 60 smooth closed surfaces did).
  bool keep_boundary = false;
  int most_points = -1;  ///< vertices that may be added; -1: no limit

  /// Wanted length of edges, mm: circumradii are kept below it.
  std::function<double(const Eigen::Vector3d&)> edge;
  /// If the boundary isn't kept: rising planes across x, y, z, at whose crossings `edge` is sampled. They must hold all
  /// of the solid.
  std::array<std::vector<double>, 3> grid;
};

/// Constrained Delaunay tetrahedra, refined to the wanted edges (radius-edge ratio 1.4 and dihedral angles of 14
/// degrees where the boundary lets them; where slivers below kGoodDihedral are left, other bounds are tried and the
/// best mesh is taken). The input's points come first; `outer` and `bonded` are still empty. The same input gives the
/// same mesh. @throws Error that begins with `what` if TetGen gives up, or
/// changed a boundary that was to be kept
TetMesh fill_with_tetrahedra(const FillInput& input, const std::string& what);

/// Tetrahedra per (mm^3 / edge^3), measured on what TetGen makes of a wanted edge.
inline constexpr double kTetrahedraPerCube = 8.0;

/// More tetrahedra than this are refused before they are made: the elimination would take some 6 GB and a minute.
inline constexpr double kMostTetrahedra = 160000.0;

/// Refuses them by an estimate: `what` is the body in words, `fine_part` what its fine edges (`fine`, mm) fill.
/// @throws Error if there would be more than kMostTetrahedra, or the estimate isn't a number
void check_tetrahedra(double estimate, std::string_view what, double fine, std::string_view fine_part = "fine box");

/// Five degrees, in radians: a mesh without smaller dihedral angles is good.
inline constexpr double kGoodDihedral = 0.0872664625997165;

/// Growth of the wanted edge length per mm away from where it is fine.
inline constexpr double kEdgeGrowth = 0.4;

}  // namespace touchstone::fem
