#include "closed_forms/light_closed_forms.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.h"
#include "core/units.h"

namespace touchstone::closed_forms {
namespace {

constexpr double kSquareMillimetresPerSquareMetre = 1e6;

/// Power reflectances of the s and p polarisations by the sine and tangent forms of Fresnel's equations.
std::array<double, 2> reflectances(double n1, double n2, double angle) {
  if (n1 == n2) return {0.0, 0.0};
  if (angle < 1e-6) {
    const double r = (n1 - n2) / (n1 + n2);
    return {r * r, r * r};
  }
  const double sine = n1 / n2 * std::sin(angle);
  if (sine >= 1.0) return {1.0, 1.0};
  const double refracted = std::asin(sine);
  const double s = std::sin(angle - refracted) / std::sin(angle + refracted);
  const double p = std::tan(angle - refracted) / std::tan(angle + refracted);
  return {s * s, p * p};
}

double lateral_reach(std::span<const double> thicknesses, std::span<const double> indices, double invariant) {
  double sum = 0.0;
  for (std::size_t k = 0; k < thicknesses.size(); ++k) {
    const double sine = invariant / indices[k];
    sum += thicknesses[k] * sine / std::sqrt(std::max(1e-300, (1.0 - sine) * (1.0 + sine)));
  }
  return sum;
}

double snell_invariant(std::span<const double> thicknesses, std::span<const double> indices, double lateral) {
  TS_ASSERT(thicknesses.size() == indices.size() && !indices.empty());
  double low = 0.0;
  double high = *std::min_element(indices.begin(), indices.end());
  for (int i = 0; i < 200; ++i) {
    const double middle = 0.5 * (low + high);
    (lateral_reach(thicknesses, indices, middle) < lateral ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace

double pinhole_irradiance(double radiance, double hole_diameter, double distance, double angle, double foil_thickness) {
  const double s = foil_thickness * std::tan(angle) / hole_diameter;
  if (s >= 1.0) return 0.0;
  const double open = 2.0 / kPi * (std::acos(s) - s * std::sqrt(1.0 - s * s));
  const double area = 0.25 * kPi * hole_diameter * hole_diameter;
  return radiance * area * std::pow(std::cos(angle), 4) / (distance * distance) * open;
}

double plate_transmittance(double index, double angle) {
  double sum = 0.0;
  for (double r : reflectances(1.0, index, angle)) sum += 0.5 * (1.0 - r) / (1.0 + r);
  return sum;
}

double lambertian_radiance(double albedo, double intensity, double cosine, double distance) {
  return albedo * intensity * cosine / (kPi * distance * distance) * kSquareMillimetresPerSquareMetre;
}

double disc_share(double radius, double height) {
  return radius * radius / (radius * radius + height * height);
}

double sphere_share(double radius, double distance) {
  return radius * radius / (distance * distance);
}

double coaxial_discs_share(double radius_1, double radius_2, double distance) {
  const double r1 = radius_1 / distance;
  const double r2 = radius_2 / distance;
  const double s = 1.0 + (1.0 + r2 * r2) / (r1 * r1);
  // The usual form loses digits where the second disc is small; this is the same times its conjugate over itself.
  const double ratio2 = (radius_2 / radius_1) * (radius_2 / radius_1);
  return 2.0 * ratio2 / (s + std::sqrt(s * s - 4.0 * ratio2));
}

double sphere_cavity_radiance(double albedo, double intensity, double radius) {
  return albedo * intensity / (kPi * radius * radius * (1.0 - albedo)) * kSquareMillimetresPerSquareMetre;
}

double internal_diffuse_reflectance(double index) {
  // Beyond the critical angle all comes back: cos^2 of it. Below, Simpson's rule over x with sine = s_c (1 - x^2),
  // which takes away the root at the critical angle.
  const double critical = 1.0 / index;
  constexpr int kIntervals = 2000;
  double sum = 0.0;
  for (int i = 0; i <= kIntervals; ++i) {
    const double x = static_cast<double>(i) / kIntervals;
    const double sine = critical * (1.0 - x * x);
    const auto r = reflectances(index, 1.0, std::asin(sine));
    const double value = 0.5 * (r[0] + r[1]) * 2.0 * sine * critical * 2.0 * x;
    sum += value * ((i == 0 || i == kIntervals) ? 1.0 : (i % 2 == 1 ? 4.0 : 2.0));
  }
  return (1.0 - critical * critical) + sum / (3.0 * kIntervals);
}

double covered_plane_radiance(double index, double albedo) {
  const double mirror = reflectances(1.0, index, 0.0)[0];
  const double inside = internal_diffuse_reflectance(index);
  return mirror + (1.0 - mirror) * albedo * (1.0 - inside) / (1.0 - albedo * inside);
}

double apparent_tangent(std::span<const double> thicknesses, std::span<const double> indices, double lateral) {
  const double sine = snell_invariant(thicknesses, indices, lateral) / indices[0];
  return sine / std::sqrt(1.0 - sine * sine);
}

double layered_irradiance(std::span<const double> thicknesses, std::span<const double> indices, double lateral) {
  double height = 0.0;
  for (double thickness : thicknesses) height += thickness;
  // A ring of rays between two lateral distances; near the axis the whole cap up to a small one.
  const double step = 1e-4 * height;
  const double inner = lateral < step ? 0.0 : lateral - 0.5 * step;
  const double outer = lateral < step ? step : lateral + 0.5 * step;
  const double tan_inner = apparent_tangent(thicknesses, indices, inner);
  const double tan_outer = apparent_tangent(thicknesses, indices, outer);
  const double solid_angle = 2.0 * kPi * (1.0 / std::hypot(1.0, tan_inner) - 1.0 / std::hypot(1.0, tan_outer));
  const double ring = kPi * (outer * outer - inner * inner);

  const double invariant = snell_invariant(thicknesses, indices, lateral);
  double s = 1.0;
  double p = 1.0;
  for (std::size_t k = 0; k + 1 < indices.size(); ++k) {
    const auto r = reflectances(indices[k], indices[k + 1], std::asin(invariant / indices[k]));
    s *= 1.0 - r[0];
    p *= 1.0 - r[1];
  }
  const double cosine = std::cos(std::asin(invariant / indices.back()));
  return solid_angle / (ring * cosine) * 0.5 * (s + p) * kSquareMillimetresPerSquareMetre;
}

}  // namespace touchstone::closed_forms
