#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

namespace touchstone::fem {

/// What holds or touches a face of a gel's boundary.
enum class FaceKind : char {
  side,   ///< free, but nothing touches it
  outer,  ///< free, can be touched
  bonded  ///< clamped
};

/// A solid of straight-sided tetrahedra. Lengths in mm. A tetrahedron (a, b, c, d) has positive volume:
/// (b - a) x (c - a) . (d - a) > 0.
struct TetMesh {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<int, 4>> tetrahedra;
  std::vector<std::array<int, 3>> outer;   ///< triangles of the free outer surface that can be touched, normal out
  std::vector<std::array<int, 3>> bonded;  ///< triangles clamped to the plate
  std::vector<int> region;                 ///< per tetrahedron, from 0: which material it is of; empty: all of region 0

  int region_of(std::size_t tetrahedron) const { return region.empty() ? 0 : region[tetrahedron]; }
};

/// One more than the largest region.
int region_count(const TetMesh& mesh);

/// Faces that belong to one tetrahedron only, normal out, in the order of the tetrahedra.
std::vector<std::array<int, 3>> boundary_faces(const TetMesh& mesh);

/// The first thing wrong with a mesh, in one sentence without a full stop, or the empty string: finite vertices,
/// indices in range, no tetrahedron of zero or negative volume (flat to rounding counts as zero), no vertex without a
/// tetrahedron, no face in more than two tetrahedra, a region for each tetrahedron or for none, `outer` and `bonded`
/// are boundary faces, `outer` isn't empty and its normals point out, no triangle in both, and each connected piece is
/// bonded.
std::string fault_of(const TetMesh& mesh);

/// Signed volume of one tetrahedron, mm^3.
double volume(const TetMesh& mesh, const std::array<int, 4>& tetrahedron);

/// Smallest angle between two faces of a tetrahedron, over the whole mesh, in radians (70.5 degrees at best, zero for a
/// sliver that is flat).
double smallest_dihedral_angle(const TetMesh& mesh);

}  // namespace touchstone::fem
