#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

namespace touchstone {

/// A triangle surface. Lengths in mm; a triangle's vertices run counter-clockwise seen from outside.
struct TriangleMesh {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<int, 3>> triangles;
};

/// What is wrong with a mesh that should bound a solid: the first fault found, in one sentence without a full stop
/// ("vertex 12 isn't finite", "the edge between vertices 3 and 9 belongs to 1 triangle: the surface is open",
/// "triangles 4 and 80 cross", "it is inside out"), or the empty string if nothing is. Checks, in this order: finite
/// vertices, indices in range, no triangle of zero area, each edge in exactly two triangles of opposite sense (closed
/// and manifold), positive volume, no two triangles that cross or touch elsewhere than in vertices and edges that they
/// share (decided exactly, without a tolerance; 0.1 s for 50,000 triangles).
std::string fault_of_closed_mesh(const TriangleMesh& mesh);

/// Signed volume that a closed mesh encloses, in mm^3; positive if its normals point outwards.
double enclosed_volume(const TriangleMesh& mesh);

/// Unit normals at the vertices: means of the triangles round each, weighted by their areas; zero where there are none.
std::vector<Eigen::Vector3d> vertex_normals(const TriangleMesh& mesh);

/// Joins vertices that are nearer than `distance` (mm) and drops the triangles that collapse. glTF files split
/// vertices at seams of normals or texture; the solid is the same. `kept`, if given, becomes the former number of each
/// triangle that is left.
TriangleMesh weld(const TriangleMesh& mesh, double distance, std::vector<int>* kept = nullptr);

}  // namespace touchstone
