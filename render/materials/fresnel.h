#pragma once

#include <algorithm>
#include <cmath>

namespace touchstone::render {

/// What a smooth face between two clear media does to light: power reflectances of the two polarisations and the
/// cosine of the refracted ray (0 under total reflection, where both reflectances are 1).
struct FresnelFace {
  double reflectance_s = 0.0;
  double reflectance_p = 0.0;
  double cos_refracted = 1.0;

  double mean_reflectance() const { return 0.5 * (reflectance_s + reflectance_p); }
};

/// Fresnel's equations for a ray in index `n_from` that meets index `n_to` at cosine `cos_incident` in [0, 1].
inline FresnelFace fresnel(double n_from, double n_to, double cos_incident) {
  if (n_from == n_to) return {0.0, 0.0, cos_incident};
  const double c1 = std::clamp(cos_incident, 0.0, 1.0);
  const double eta = n_from / n_to;
  const double cos2_squared = 1.0 - eta * eta * (1.0 - c1 * c1);
  if (cos2_squared <= 0.0) return {1.0, 1.0, 0.0};
  const double c2 = std::sqrt(cos2_squared);
  const double s = (n_from * c1 - n_to * c2) / (n_from * c1 + n_to * c2);
  const double p = (n_to * c1 - n_from * c2) / (n_to * c1 + n_from * c2);
  return {s * s, p * p, c2};
}

/// What the smooth face of a medium of this index to air sends back of light that comes from within, evenly from all
/// directions: the mean of Fresnel's reflectance over the squared sine, one beyond the critical angle [Walsh1926].
inline double diffuse_reflectance_within(double index) {
  constexpr int kSteps = 2000;
  const double critical = std::min(1.0, 1.0 / (index * index));
  double sum = 0.0;
  for (int i = 0; i < kSteps; ++i) {
    const double sine_squared = critical * (i + 0.5) / kSteps;
    sum += fresnel(index, 1.0, std::sqrt(1.0 - sine_squared)).mean_reflectance();
  }
  return 1.0 - critical + critical * sum / kSteps;
}

}  // namespace touchstone::render
