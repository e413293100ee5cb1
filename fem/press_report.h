#pragma once

#include <Eigen/SparseCholesky>

#include "fem/press.h"
#include "fem/press_part.h"

namespace touchstone::fem {

using SurfaceMassFactor = Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>;

/// What a snapshot means for the user: wrench, displacements of surface and beads, and how well it was solved.
PressState report(const Compliance& gel, const ContactSurface& surface, const SurfaceMassFactor& mass, double friction,
                  const PressSnapshot& snapshot);

}  // namespace touchstone::fem
