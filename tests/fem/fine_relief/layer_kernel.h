#pragma once

#include <cmath>
#include <numbers>

#include "fem/elements/elastic_material.h"

namespace touchstone::fem::fixtures {

/// Normal displacement over normal pressure on the face of an infinite bonded layer, frictionless, at wave number q
/// over the thickness; relative to the half space; the kernel of bonded_layer_kernel
/// (closed_forms/contact_closed_forms.h).
inline double layer_kernel(double q, double nu) {
  if (q > 20.0) {
    return 1.0;
  }
  if (q < 1e-3) {
    return q * (1.0 - 2.0 * nu) / (2.0 * (1.0 - nu) * (1.0 - nu));  // the confined modulus; next term O(q^3)
  }
  const double a = 3.0 - 4.0 * nu;
  return (a * std::sinh(2.0 * q) - 2.0 * q) / (a * std::cosh(2.0 * q) + 2.0 * q * q + 5.0 - 12.0 * nu + 8.0 * nu * nu);
}

/// Work of the pressure exp(-r^2 / (2 s^2)) (MPa) over the displacement it causes on an infinite bonded layer: N mm.
inline double gaussian_pressure_work(const ElasticMaterial& material, double thickness, double s) {
  const double nu = material.poisson_ratio;
  double integral = 0.0;
  const int steps = 4000;
  const double end = 8.0 / s;
  for (int i = 0; i < steps; ++i) {
    const double k = end * (i + 0.5) / steps;
    integral += layer_kernel(k * thickness, nu) * std::exp(-k * k * s * s) * end / steps;
  }
  return 4.0 * std::numbers::pi * (1.0 - nu * nu) / material.youngs_modulus * std::pow(s, 4) * integral;
}

}  // namespace touchstone::fem::fixtures
