#pragma once
// The finite-strain problem of a neo-Hookean gel on the Taylor-Hood space: total Lagrangian, all integrals over the
// undeformed mesh. Find u, p that make
//   Pi(u, p) = int W(I + grad u, p) dV - (work of the loads)
// stationary (W: fem/finite_strain/neo_hookean.h). Where the tangent at rest is the linear system of
// fem/elements/taylor_hood.h.

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "fem/elements/schur_solver.h"
#include "fem/elements/taylor_hood.h"
#include "fem/finite_strain/neo_hookean.h"

namespace touchstone::fem {

/// Energy, residual and tangent of one gel at any state. A state is an ElasticSolution: displacement of all nodes (mm,
/// clamped ones included) and pressures (MPa). Vectors over the space's unknowns are without units, as in assemble().
class FiniteStrain {
 public:
  /// One material a region. The space must outlive this. @throws Error for a bad material
  FiniteStrain(const TaylorHoodSpace& space, std::span<const ElasticMaterial> materials);
  FiniteStrain(const TaylorHoodSpace& space, const ElasticMaterial& material);  ///< the same in all regions

  const TaylorHoodSpace& space() const { return space_; }
  const Scales& scales() const { return scales_; }

  /// No displacement, no pressure.
  ElasticSolution at_rest() const;

  /// int W dV, N mm; at a solution it is the elastic energy stored. Infinite if a tetrahedron is inside out.
  double stored_energy(const ElasticSolution& state) const;

  /// The least J = det F over all points of integration. Above zero: no tetrahedron is inside out.
  double smallest_volume_ratio(const ElasticSolution& state) const;

  /// dPi/d(unknowns) without the loads. `scale` is the root of the squared sum of the elements' own forces: what the
  /// residual is small against.
  struct Residual {
    Eigen::VectorXd values;
    double scale = 0.0;
  };
  /// At any state in which no tetrahedron is inside out.
  Residual residual(const ElasticSolution& state) const;

  /// The residual's derivative, symmetric. Element blocks are added in the elements' order whatever the number of
  /// threads.
  SymmetricEntries tangent(const ElasticSolution& state) const;

  /// The residual's change, to first order, when the clamped nodes move by `change` (nodes x 3, mm; other rows are
  /// ignored).
  Eigen::VectorXd clamped_pull(const ElasticSolution& state, const Eigen::MatrixX3d& change) const;

  /// state + factor * change of the unknowns.
  ElasticSolution moved(const ElasticSolution& state, const Eigen::VectorXd& change, double factor) const;

 private:
  struct ElementState;
  ElementState element_state(const ElasticSolution& state, int element) const;
  ElementRow element_row(const ElementState& state, int node, const std::array<bool, 10>& wanted) const;

  const TaylorHoodSpace& space_;
  Scales scales_;
};

/// What a solution took.
struct FiniteStrainEffort {
  int steps = 0;                  ///< in how many parts the loads were applied
  int iterations = 0;             ///< systems factorised, with those of parts that failed
  std::vector<double> residuals;  ///< of the last part, one an iteration, relative to Residual::scale
};

/// Solves one load case by Newton's method with line search, the loads applied in parts where one go doesn't converge.
/// Tractions and body forces are nominal (per undeformed area and volume, of fixed direction).
/// @throws Error for a bad mesh or material, or where the smallest part of the load allowed still fails: what stopped
/// it
ElasticSolution solve_finite_strain(const TaylorHoodSpace& space, std::span<const ElasticMaterial> materials,
                                    const ElasticLoads& loads, FiniteStrainEffort* effort = nullptr);
ElasticSolution solve_finite_strain(const TaylorHoodSpace& space, const ElasticMaterial& material,
                                    const ElasticLoads& loads, FiniteStrainEffort* effort = nullptr);

}  // namespace touchstone::fem
