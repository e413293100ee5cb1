#include "fem/elements/elastic_material.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace touchstone::fem {

void check(const ElasticMaterial& material) {
  if (!std::isfinite(material.youngs_modulus) || material.youngs_modulus <= 0.0) {
    fail("Young's modulus is {} MPa; it must be finite and above zero", material.youngs_modulus);
  }
  if (!(material.poisson_ratio >= 0.0 && material.poisson_ratio <= 0.5)) {
    fail("Poisson's ratio is {}; it must be from 0 to 0.5", material.poisson_ratio);
  }
}

double shear_modulus(const ElasticMaterial& material) {
  return material.youngs_modulus / (2.0 * (1.0 + material.poisson_ratio));
}

double lame_ratio(const ElasticMaterial& material) {
  const double nu = std::min(material.poisson_ratio, kLargestPoissonRatio);
  return 2.0 * nu / (1.0 - 2.0 * nu);
}

}  // namespace touchstone::fem
