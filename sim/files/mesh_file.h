#pragma once

#include <filesystem>

#include "core/triangle_mesh.h"

namespace touchstone::sim {

/// The unit that files of this kind are mostly written in: the metre for glTF (.glb, .gltf), whose standard says so;
/// the millimetre for STL, OBJ and PLY, which say nothing.
/// @throws Error for another suffix. Capital letters don't matter
double usual_mm_per_unit(const std::filesystem::path& path);

/// Reads the solid in a file of one of these kinds, told by its suffix, and scales it by `mm_per_unit`; glTF as
/// read_gltf_mesh does, the others as read_plain_mesh.
/// @throws Error that names the file and the fault; also for another suffix
TriangleMesh read_mesh_file(const std::filesystem::path& path, double mm_per_unit);

}  // namespace touchstone::sim
