#pragma once
// Free vibration of the clamped gel: K u = omega^2 M u with the Taylor-Hood stiffness and a consistent mass matrix.
//
// The pressure has no mass, so at nu = 0.5 as many eigenvalues are infinite as there are pressures, and near it they
// are very large. Lanczos works on displacements alone, with the operator that takes x to the displacement part of
// K^-1 [M x; 0], K being the whole mixed system: its largest eigenvalues are 1 / omega^2 of the lowest modes, and all
// that is (nearly) incompressible has the eigenvalue zero there. One factorisation serves all of it (spectral
// transformation: [Ericsson1980]; mixed problems: [Boffi2013, sec. 6.5]).

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <span>

#include "fem/elements/taylor_hood.h"

namespace touchstone::fem {

/// nodes x nodes: int N_i N_j dV, mm^3, the quadratic functions. Exact.
Eigen::SparseMatrix<double> volume_mass(const TaylorHoodSpace& space);

/// The lowest modes of the gel, clamped where it is bonded.
struct Eigenmodes {
  Eigen::VectorXd angular_frequency;  ///< k, rad/s, rising
  Eigen::MatrixXd displacement;       ///< 3 nodes x k: component a of node i in row 3 i + a. int rho u_j . u_k dV =
                                      ///< delta_jk, so the unit is tonne^-1/2
  int solves = 0;                     ///< of the factorised system
};

/// The `count` lowest modes of the gel, clamped where it's bonded. `density` in tonne/mm^3 (1e-12 per kg/m^3). `held`:
/// vertices of the outer surface (as outer_surface numbers them) whose hat-weighted displacement int phi u dA is held
/// at zero besides, as by a rigid body that sticks to them. That no mode below the last one is missing is checked by
/// the inertia of K - sigma M (Sylvester's law), at the price of a second factorisation. `materials` has one entry for
/// each region of the mesh, for which the space was made; the density is the same in all of them.
/// @throws Error for a bad mesh, material, density or count (from 1 to a fifth of the displacement's unknowns), or if
/// the iteration doesn't converge
Eigenmodes lowest_eigenmodes(const TaylorHoodSpace& space, std::span<const ElasticMaterial> materials, double density,
                             int count, std::span<const int> held = {});
Eigenmodes lowest_eigenmodes(const TaylorHoodSpace& space, const ElasticMaterial& material, double density, int count,
                             std::span<const int> held = {});  ///< the same in all regions

}  // namespace touchstone::fem
