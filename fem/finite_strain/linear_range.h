#pragma once
// How far linear elasticity serves: its forces beside a finite-strain solution's on the same mesh.

#include <span>
#include <vector>

#include "core/progress.h"
#include "fem/elements/compliance.h"
#include "fem/finite_strain/finite_gel.h"
#include "fem/shapes/contact_shape.h"

namespace touchstone::fem {

/// One reference press, straight down in the middle of the gel.
struct LinearRangeRow {
  double depth = 0.0;           ///< mm under the undeformed surface
  double linear_force = 0.0;    ///< N
  double finite_force = 0.0;    ///< N, neo-Hookean
  double largest_strain = 0.0;  ///< PressState::largest_strain of the linear press
  double linear_seconds = 0.0;  ///< what the step took on the clock
  double finite_seconds = 0.0;

  /// How far the linear force is off, as a part of the finite one.
  double difference() const { return linear_force / finite_force - 1.0; }
};

/// What a reference press may take; one that takes more has no answer.
inline constexpr int kRangeFactorisations = 40;

/// Parts of the thickness that reference presses go down to.
inline constexpr double kRangeDepths[] = {0.05, 0.1, 0.2};

/// Presses a body on the gel by both theories, to each part of the gel's thickness in `depths` (rising; above zero).
/// `linear` must be the compliance of gel.mesh with the same materials. The table ends where one of the two has no
/// answer. `friction` as for Press. @throws Error for a bad shape, friction or depth, or a body that isn't over the gel
std::vector<LinearRangeRow> measure_linear_range(const Compliance& linear, const FiniteGel& gel,
                                                 const ContactShape& shape, double friction,
                                                 std::span<const double> depths = kRangeDepths,
                                                 const Progress& progress = {});

}  // namespace touchstone::fem
