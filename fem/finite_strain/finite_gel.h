#pragma once

#include <Eigen/SparseCore>
#include <span>
#include <vector>

#include "fem/contact/contact_gap.h"
#include "fem/elements/compliance.h"
#include "fem/elements/elimination_order.h"
#include "fem/elements/surface_coupling.h"
#include "fem/finite_strain/finite_strain.h"

namespace touchstone::fem {

/// A gel and all that its presses share. Stays where it was made.
struct FiniteGel {
  /// One material a region of the mesh. @throws Error as compute_compliance
  FiniteGel(TetMesh mesh, std::span<const ElasticMaterial> materials, std::span<const Bead> beads, double thickness);
  FiniteGel(const FiniteGel&) = delete;
  FiniteGel& operator=(const FiniteGel&) = delete;

  TetMesh mesh;
  TaylorHoodSpace space;
  FiniteStrain problem;
  double thickness;
  EliminationTree tree;
  OuterSurface outer;
  Eigen::SparseMatrix<double> mass;                          ///< n x n: int phi_i phi_j dA, mm^2
  Eigen::SparseMatrix<double, Eigen::RowMajor> coupling;     ///< n x nodes: int phi_i N_k dA, mm^2
  Eigen::SparseMatrix<double, Eigen::RowMajor> bead_weight;  ///< beads x nodes: mean over each bead's surface
  ContactSurface rest;                                       ///< the undeformed outer surface
};

}  // namespace touchstone::fem
