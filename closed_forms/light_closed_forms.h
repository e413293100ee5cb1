#pragma once
// What light does where the answer is known on paper: for tests and for `touchstone validate light`. Nothing here uses
// the renderer. Lengths in mm, angles in radians, radiances in W/m^2/sr, irradiances in W/m^2, intensities in W/sr.

#include <span>

namespace touchstone::closed_forms {

/// Irradiance at the sensor behind a round hole of diameter `hole_diameter` in a foil of thickness `foil_thickness`, at
/// `angle` from the axis, sensor at `distance`, scene of radiance L everywhere:
/// E = L A0 cos^4 / f^2 * (2/pi)(acos s - s sqrt(1 - s^2)), s = foil tan(angle) / diameter. The last factor is the
/// common area of the two rims' discs; exact in the limit diameter << distance.
double pinhole_irradiance(double radiance, double hole_diameter, double distance, double angle, double foil_thickness);

/// Share of unpolarised light that passes a clear plane plate, all internal reflections counted (incoherent):
/// T = 1/2 sum over s and p of (1 - R)/(1 + R), R Fresnel's reflectance of one face at `angle` in air.
double plate_transmittance(double index, double angle);

/// Radiance of a Lambertian surface lit by a point source: L = albedo I cos / (pi r^2). `distance` in mm.
double lambertian_radiance(double albedo, double intensity, double cosine, double distance);

/// Share of a small patch's cosine-weighted hemisphere that a facing coaxial disc covers: R^2 / (R^2 + h^2).
double disc_share(double radius, double height);

/// The same for a sphere on the patch's normal, centre at `distance`: (R / d)^2.
double sphere_share(double radius, double distance);

/// Share of what the first of two coaxial parallel discs sends out that meets the second (form factor):
/// F12 = (S - sqrt(S^2 - 4 (r2/r1)^2)) / 2, S = 1 + (1 + R2^2) / R1^2, R = r / h.
double coaxial_discs_share(double radius_1, double radius_2, double distance);

/// Radiance inside a closed Lambertian sphere with an isotropic point source at its centre, all reflections counted:
/// L = albedo I / (pi R^2 (1 - albedo)).
double sphere_cavity_radiance(double albedo, double intensity, double radius);

/// Diffuse light in a medium of `index` that meets the flat face to air from inside: the share that comes back,
/// 2 int R(theta) cos sin d theta with Fresnel's R (1 beyond the critical angle). 0.536 for 1.41.
double internal_diffuse_reflectance(double index);

/// A wide Lambertian plane covered by a clear layer of `index`, under surroundings of radiance one; radiance seen from
/// air along the normal, the face's own mirror image included: F + (1 - F) albedo (1 - r)/(1 - albedo r), r the
/// internal diffuse reflectance, F Fresnel's reflectance along the normal (after [Saunderson1942]). One for a white
/// plane.
double covered_plane_radiance(double index, double albedo);

/// Tangent of the angle in the first medium at which a point is seen (or lit) through flat layers of the given
/// thicknesses and indices when it lies `lateral` to the side: Snell's law solved by bisection.
double apparent_tangent(std::span<const double> thicknesses, std::span<const double> indices, double lateral);

/// Irradiance, square to the arriving ray, from a point source of unit intensity (W/sr) through flat layers, Fresnel's
/// loss at each face included: by differences of apparent_tangent (a bundle's solid angle over its cross section) and
/// the product of each polarisation's transmittances. The source stands in the first layer.
double layered_irradiance(std::span<const double> thicknesses, std::span<const double> indices, double lateral);

}  // namespace touchstone::closed_forms
