#pragma once
// The tangent of a finite-strain press, factorised: the gel's, the bodies' led axes and what contact adds.

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "fem/elements/quasi_definite_schur.h"
#include "fem/finite_strain/finite_part.h"

namespace touchstone::fem {

/// Factorised at one state, for the vertices of a block.
struct FiniteTangent {
  std::vector<int> block;                       ///< vertices that may touch, rising
  std::vector<LedAxis> led;                     ///< axes whose forces and torques are given
  int components = 1;                           ///< rows a vertex, as in LawRows
  Eigen::MatrixXd compliance;                   ///< of the rows as in LawRows, mm^3 per MPa
  std::shared_ptr<const FrontalFactor> factor;  ///< of the gel's unknowns and the led axes', without units
};

/// At the state `at`, with its gap. `axes` as for law_rows. @throws Error if the tangent is singular
FiniteTangent finite_tangent(const FiniteGel& gel, const FiniteSnapshot& at, const std::vector<Eigen::Matrix3d>& axes,
                             std::vector<int> block, int components, std::vector<LedAxis> led);

/// The same with more vertices, by solutions with its factor: a sixtieth of a new one for each row. Vertices whose gap
/// isn't finite are left out.
FiniteTangent with_vertices(const FiniteTangent& tangent, const FiniteGel& gel, const FiniteSnapshot& at,
                            const std::vector<Eigen::Matrix3d>& axes, const std::vector<int>& more);

/// A contact problem's compliance and the gaps and slips that it begins with.
struct ContactLaws {
  Eigen::MatrixXd compliance;  ///< mm^3 per MPa
  Eigen::VectorXd ahead;       ///< mm^3
};

/// A gel under pressure is stable in the hold of its contact, not under the same pressure as dead load (from a pressure
/// of some 2 G on). What is held, the rows `held`, is therefore made stiff by `stiffness` (each row's, MPa per mm^3),
/// by terms that vanish where it holds (the augmented Lagrangian of [Hestenes1969] and [Powell1969]), so that the
/// compliance is positive definite. The tractions that answer the laws are the same.
ContactLaws held_stiffly(const ContactLaws& laws, const std::vector<int>& held, const Eigen::VectorXd& stiffness);

/// The stiffness of a vertex's hold, MPa per mm^3.
double hold_stiffness(const FiniteGel& gel, int vertex);
/// What takes from a led axis nearly all of the stiffness that the tangent gives it, where contact holds it instead;
/// MPa per mm^3, below zero.
double shift_release(const FiniteGel& gel);

}  // namespace touchstone::fem
