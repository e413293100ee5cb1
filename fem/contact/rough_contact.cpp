#include "fem/contact/rough_contact.h"

#include <cmath>

#include "core/error.h"

namespace touchstone::fem {

double contact_modulus(const ElasticMaterial& material, const std::optional<ElasticMaterial>& other) {
  const auto softness = [](const ElasticMaterial& m) {
    check(m);
    return (1.0 - m.poisson_ratio * m.poisson_ratio) / m.youngs_modulus;
  };
  return 1.0 / (softness(material) + (other ? softness(*other) : 0.0));
}

double real_contact_share(double pressure, double contact_modulus, double rms_slope) {
  TS_ASSERT(pressure >= 0.0 && contact_modulus > 0.0 && rms_slope >= 0.0);
  if (pressure == 0.0) return 0.0;
  return rms_slope == 0.0 ? 1.0 : std::erf(std::sqrt(2.0) * pressure / (contact_modulus * rms_slope));
}

}  // namespace touchstone::fem
