#pragma once

#include "fem/elements/compliance.h"

namespace touchstone::test {

/// A surface in closed form, for tests of contact that need no finite elements: an elastic half space (Boussinesq's and
/// Cerruti's solutions) whose response is taken a depth of 0.28 `spacing` away from the load, which makes its
/// compliance symmetric positive definite and, at the loaded vertex itself, about that of a hat-shaped load. Vertices
/// stand on a square grid of `spacing` over |x|, |y| <= half_width. `thickness` only serves the check of depth.
fem::Compliance half_space_gel(double half_width, double spacing, const fem::ElasticMaterial& material,
                               double thickness);

/// P1 mass matrix of a triangle surface.
Eigen::SparseMatrix<double> surface_mass(const std::vector<Eigen::Vector3d>& vertices,
                                         const std::vector<std::array<int, 3>>& triangles);

}  // namespace touchstone::test
