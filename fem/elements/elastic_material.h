#pragma once

namespace touchstone::fem {

/// Linear isotropic elasticity: Young's modulus in MPa, Poisson's ratio from 0 to 0.5 (0.5 itself is legal).
struct ElasticMaterial {
  double youngs_modulus = 1.0;
  double poisson_ratio = 0.49;
};

/// Poisson's ratio is taken as no more than this: forces agree to 7 digits from there to 0.5.
inline constexpr double kLargestPoissonRatio = 0.5 - 1e-8;

/// @throws Error unless the modulus is finite and above zero and Poisson's ratio from 0 to 0.5
void check(const ElasticMaterial& material);

/// Shear modulus G = E / (2 (1 + nu)), MPa.
double shear_modulus(const ElasticMaterial& material);

/// Lame's lambda over G, 2 nu / (1 - 2 nu), with Poisson's ratio capped at kLargestPoissonRatio.
double lame_ratio(const ElasticMaterial& material);

}  // namespace touchstone::fem
