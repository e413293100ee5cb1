#pragma once

#include <filesystem>

#include "core/triangle_mesh.h"

namespace touchstone::sim {
/// What a file's ending says.
enum class PlainMeshFormat { stl, obj, ply };

/// Reads the solid in an STL, OBJ or PLY file, text or binary: all of its triangles, scaled by `mm_per_unit`, vertices
/// welded as glTF's are (closed_solid). Faces with more corners are cut into triangles. Coordinates are single
/// precision. Points, lines, normals, colours and materials aren't looked at, and no other file is opened.
/// A library reads it in a process of its own, so that no file can do more than be refused.
/// @throws Error that names the file and the fault: unreadable, damaged or truncated; counts that the file doesn't
/// keep; a face that names a vertex that isn't there; numbers that aren't finite; too many triangles; a surface that
/// isn't closed, crosses itself or is inside out (fault_of_closed_mesh)
TriangleMesh read_plain_mesh(const std::filesystem::path& path, PlainMeshFormat format, double mm_per_unit);

}  // namespace touchstone::sim
