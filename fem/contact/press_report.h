#pragma once

#include <Eigen/SparseCholesky>
#include <vector>

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

/// Whether a body's contact is wider than an edge or two all round: with fewer than 13 vertices, or none that has only
/// touching ones beside it (as along a knife's edge), forces may be several percent off. `owner` as in
/// PressState::node_owner.
bool is_resolved(const ContactSurface& surface, const std::vector<int>& owner, int body);

}  // namespace touchstone::fem
