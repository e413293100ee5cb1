#pragma once
// A rigid body pressed on a neo-Hookean gel at finite strain, step by step along a motion: what fem/press.h does in
// linear elasticity, slower (a factorisation of the whole gel each Newton iteration) and without its limits.
//
// Each Newton iterate factorises the tangent bordered by the rows of the vertices that may touch. The Schur complement
// is the surface compliance at that state, so contact with Coulomb friction is solved on it as in the linear case, and
// the volume follows by two solutions with the same factorisation. Gaps and the direction of contact forces belong to
// the deformed surface (fem/finite_contact.h). Tractions are nominal: force per undeformed area. Friction acts in the
// plane across the vertex's mean contact direction, against the motion relative to the object since the last step.

#include <Eigen/SparseCore>
#include <memory>
#include <span>
#include <vector>

#include "fem/compliance.h"
#include "fem/contact_gap.h"
#include "fem/contact_shape.h"
#include "fem/finite_strain.h"
#include "fem/press.h"
#include "fem/surface_coupling.h"

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
  std::vector<int> order;  ///< of elimination
  OuterSurface outer;
  Eigen::SparseMatrix<double> mass;                          ///< n x n: int phi_i phi_j dA, mm^2
  Eigen::SparseMatrix<double, Eigen::RowMajor> coupling;     ///< n x nodes: int phi_i N_k dA, mm^2
  Eigen::SparseMatrix<double, Eigen::RowMajor> bead_weight;  ///< beads x nodes: mean over each bead's surface
  ContactSurface rest;                                       ///< the undeformed outer surface
};

class FinitePress {
 public:
  /// `friction` as for Press. The gel must outlive this. Of the tolerance, `force`, `lookup_mm` (here: what the gaps
  /// are closed to) and `traction` (of the laws of friction; a hundred times that) count.
  /// @throws Error for a shape or a friction that isn't allowed
  FinitePress(const FiniteGel& gel, ContactShape shape, double friction, PressTolerance tolerance = {});
  FinitePress(FinitePress&&) noexcept;
  FinitePress& operator=(FinitePress&&) noexcept;
  ~FinitePress();

  /// Moves the object to the target, in parts of no more than a tenth of the gel's thickness, halved where Newton's
  /// method doesn't converge. In the state, `solves` counts contact problems, `factorisations` those of the gel,
  /// `parts` the parts; `lookup_error` is zero.
  /// @throws Error, the state being as before the step, as Press::step; and if a tetrahedron would turn inside out or
  /// Newton's method stalls in the smallest part allowed
  const PressState& step(const PressTarget& target);

  const PressState& state() const;

  /// The gel's displacement and pressure at the last step.
  const ElasticSolution& solution() const;
  /// N mm, elastic energy at the last step.
  double stored_energy() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace touchstone::fem
