#pragma once

namespace touchstone::fem {

/// Linear isotropic elasticity: Young's modulus in MPa, Poisson's ratio from 0 to 0.5 (0.5 itself is legal).
struct ElasticMaterial {
  double youngs_modulus = 1.0;
  double poisson_ratio = 0.49;
};

}  // namespace touchstone::fem
