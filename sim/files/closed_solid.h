#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

#include "core/triangle_mesh.h"

namespace touchstone::sim {

/// More aren't read from a file.
inline constexpr std::size_t kMostTriangles = 20'000'000;

/// @throws Error that names the file if the unit isn't a finite number above 0
void check_unit(const std::filesystem::path& path, double mm_per_unit);

/// The solid that a file's triangles bound: vertices welded that are nearer than a millionth of its diagonal, triangles
/// that collapse in that left out, and vertices of no triangle. `kept`, if given, becomes the number in the file of
/// each triangle that is left.
/// @pre triangles name vertices that are there
/// @throws Error that names the file and the fault: no triangles, or one of fault_of_closed_mesh
TriangleMesh closed_solid(const TriangleMesh& triangles, const std::filesystem::path& path,
                          std::vector<int>* kept = nullptr);

}  // namespace touchstone::sim
