#pragma once

#include <filesystem>
#include <vector>

#include "core/triangle_mesh.h"
#include "fem/mesh/tet_mesh.h"

namespace touchstone::sim {

/// Reads the solid in a glTF 2.0 file (.glb, or .gltf with its buffers embedded or beside it): all triangles of the
/// file's scene (its first one if it names none), moved by their nodes, scaled by `mm_per_unit` (glTF's unit is the
/// metre: 1000), vertices welded that are nearer than a millionth of the solid's diagonal. Axes stay as they are in the
/// file. Materials and pictures aren't looked at.
/// @throws Error that names the file and the fault: unreadable or damaged; primitives other than triangle lists;
/// sparse, compressed, quantised, skinned or morphed geometry; nodes in a circle; numbers that aren't finite; a surface
/// that isn't closed, crosses itself or is inside out (fault_of_closed_mesh)
TriangleMesh read_gltf_mesh(const std::filesystem::path& path, double mm_per_unit);

/// A gel's surface: what each of its triangles is.
struct GelSurface {
  TriangleMesh mesh;
  std::vector<fem::FaceKind> faces;
};

/// Reads a gel's solid as read_gltf_mesh does. A triangle list whose material is named `outer` can be touched, one
/// named `bonded` is clamped to the plate, one named `side` is free and not touched. Where a list has no material (or
/// one without a name), the name of its mesh says so; with another name it is a free side.
/// @throws Error as read_gltf_mesh; for a material of another name; if no face is bonded, or none outer
GelSurface read_gltf_gel(const std::filesystem::path& path, double mm_per_unit);

}  // namespace touchstone::sim
