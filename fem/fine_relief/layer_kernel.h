#pragma once
// What a pressure does to the face of an endless elastic layer bonded below: its response in wave numbers, and in
// space.

#include <vector>

#include "fem/elements/elastic_material.h"

namespace touchstone::fem {

/// M(q): normal displacement of the face under a frictionless pressure of wave number k, relative to the half space's,
/// q = k * thickness. u(k) = 2 (1 - nu^2) / (E k) M(k h) p(k),
/// M(q) = [(3-4nu) sinh 2q - 2q] / [(3-4nu) cosh 2q + 2q^2 + 5 - 12nu + 8nu^2].
/// Evaluated without overflow at large q and without cancellation at small q. Poisson's ratio from 0 to 0.5, capped at
/// kLargestPoissonRatio. @pre q >= 0
double layer_over_half_space(double poisson_ratio, double q);

/// M(q) - 1, which falls as exp(-2q) and is given to full relative precision.
double layer_less_half_space(double poisson_ratio, double q);

/// Displacement over pressure at wave number k (1/mm), mm/MPa. k = 0: a uniform pressure, which only the layer's
/// confined modulus holds, h (1+nu)(1-2nu) / (E (1-nu)).
double layer_compliance(const ElasticMaterial& material, double thickness, double k);

/// What the bonded base adds to the half space's displacement by a point force: as a function of rho = distance over
/// thickness, g(rho) = integral over q from 0 of (M(q) - 1) J0(q rho); the face moves by
/// (1 - nu^2) / (pi E h) (1/rho + g(rho)) per unit force. The sum falls as exp(-0.77 rho) (nu = 0.5; faster below): it
/// is 6e-5 at rho = 10, and beyond kReach, where it is under 1e-10, it counts as zero.
class LayerCorrection {
 public:
  /// Tabulates g up to `largest` (or kReach, if that is less). Interpolation is good to 1e-9.
  LayerCorrection(double poisson_ratio, double largest);

  static constexpr double kReach = 30.0;

  /// @pre 0 <= rho <= largest, kReach
  double value(double rho) const;
  /// The Laplacian of g over the plane, in units of 1/h^2.
  double laplacian(double rho) const;

 private:
  std::vector<double> value_, slope_, laplacian_;
};

}  // namespace touchstone::fem
