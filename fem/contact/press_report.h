#pragma once

#include <Eigen/SparseCholesky>

#include "fem/contact/press.h"
#include "fem/contact/press_part.h"

namespace touchstone::fem {

/// Factorisation of the surface's mass matrix, by which loads at vertices become tractions.
using SurfaceMassFactor = Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>;

/// What a snapshot means for the user: wrenches, displacements of surface and beads, and how well it was solved.
PressState report(const Compliance& gel, const PartSolver& solver, const SurfaceMassFactor& mass, PressOutput output,
                  const PressSnapshot& snapshot);

/// The surface's displacement and the strain measures, of the weighted one (3n: int phi_i u_a dA, mm^3).
void add_displacement(const Compliance& gel, const ContactSurface& surface, const SurfaceMassFactor& mass,
                      const Eigen::VectorXd& weighted, PressState& state);

}  // namespace touchstone::fem
