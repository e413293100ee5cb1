#pragma once
// A frame's geometry as binary glTF 2.0 (.glb), for any viewer.

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "core/transform.h"
#include "core/triangle_mesh.h"

namespace touchstone::sim {

/// A surface, shown once at each of `places` (gel frame, mm).
struct GltfPart {
  std::string name;
  TriangleMesh mesh;
  Eigen::Vector3d colour = {0.5, 0.5, 0.5};  ///< linear, 0 to 1
  double opacity = 1.0;
  bool metal = false;
  std::vector<Eigen::Vector3d> places = {Eigen::Vector3d::Zero()};
};

/// A camera of the file, from which a viewer can look.
struct GltfCamera {
  RigidTransform gel_from_camera;  ///< core/transform.h: +z along the view, +y down
  double vertical_view = 0.5;      ///< radians, of the whole picture
  double aspect = 1.0;             ///< width over height
};

/// The bytes of a .glb. Vertices are stored in mm of the gel frame, rounded to float; a root node `gel frame, mm` takes
/// them to glTF's metres with y up (gel +z is up, gel +y towards -z). Parts without triangles are left out. Cameras
/// stand beside that root, as glTF wants them unscaled. The same parts give the same bytes.
/// @throws Error for a vertex that isn't finite, or more than 4 GB
std::string glb_bytes(const std::vector<GltfPart>& parts, const std::vector<GltfCamera>& cameras);

/// The same as a file, there whole or not at all. @throws Error naming the file
void write_glb(const std::filesystem::path& path, const std::vector<GltfPart>& parts,
               const std::vector<GltfCamera>& cameras);

}  // namespace touchstone::sim
