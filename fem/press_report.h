#pragma once

#include <Eigen/SparseCholesky>

#include "fem/press.h"
#include "fem/press_part.h"

namespace touchstone::fem {

using SurfaceMassFactor = Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>;

/// What a snapshot means for the user: wrenches, displacements of surface and beads, and how well it was solved.
PressState report(const Compliance& gel, const PartSolver& solver, const SurfaceMassFactor& mass, PressOutput output,
                  const PressSnapshot& snapshot);

}  // namespace touchstone::fem
