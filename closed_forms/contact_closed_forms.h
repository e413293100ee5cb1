#pragma once
// What contact mechanics knows on paper: for tests and for `touchstone validate mechanics`. Nothing here uses the
// finite elements. N, mm, MPa; nu is Poisson's ratio, E Young's modulus, G = E / (2 (1 + nu)). Bodies are rigid,
// without friction where nothing else is said.

#include <Eigen/Core>
#include <functional>
#include <span>

namespace touchstone::closed_forms {

/// Force of a rigid sphere (paraboloid) of radius R pressed by `depth` into a half space [Hertz1882]:
/// F = 4 E sqrt(R) d^1.5 / (3 (1 - nu^2)); the contact radius is sqrt(R d).
double hertz_force(double youngs_modulus, double poisson_ratio, double radius, double depth);
/// Radius of the contact of hertz_force, mm: sqrt(R d).
double hertz_contact_radius(double radius, double depth);
/// Largest pressure, in the middle: 3 F / (2 pi a^2).
double hertz_largest_pressure(double force, double contact_radius);

/// Force of a rigid flat punch of `radius` on a half space (Boussinesq; [Sneddon1965]): F = 2 E a d / (1 - nu^2).
double flat_punch_force(double youngs_modulus, double poisson_ratio, double radius, double depth);

/// A true sphere on a half space [Sneddon1965]: depth and force for a contact radius,
/// d = (a/2) ln((R+a)/(R-a)), F = E/(2 (1-nu^2)) [(a^2 + R^2) ln((R+a)/(R-a)) - 2 a R].
double sneddon_sphere_depth(double radius, double contact_radius);
/// Force on that sphere, N: the second equation above.
double sneddon_sphere_force(double youngs_modulus, double poisson_ratio, double radius, double contact_radius);

/// A rigid sphere under normal force P, sheared by Q < mu P ([Cattaneo1938], [Mindlin1949]; coupling neglected, exact
/// along x at nu = 0.5 but for the slip's direction): stick radius over contact radius, and tangential displacement.
double mindlin_stick_ratio(double shear, double friction, double force);
/// How far the sphere has moved along the surface under Q, mm, beyond the gel far from it.
double mindlin_displacement(double youngs_modulus, double poisson_ratio, double contact_radius, double shear,
                            double friction, double force);

/// Surface displacement of a half space z < 0 at (x, y), from the origin, by a point force on the surface there.
/// Boussinesq: a push P along -z [Johnson1985, sec. 3.2]. u_r = -(1-2nu) P/(4 pi G r), u_z = -(1-nu) P/(2 pi G r);
/// given are the components along x, y, z.
Eigen::Vector3d boussinesq_displacement(double youngs_modulus, double poisson_ratio, double push, double x, double y);
/// Cerruti: a force Q along +x [Johnson1985, sec. 3.6], where z points into the body.
Eigen::Vector3d cerruti_displacement(double youngs_modulus, double poisson_ratio, double shear, double x, double y);

/// Stiffness factor of a flat punch on a bonded layer for nu = 0.3 [Hayes1972]:
/// P = 4 G a kappa w / (1 - nu). Known ratios a/h are 0.2, 0.4, 1 and 2. @pre ratio is one of these
double hayes_kappa(double radius_over_thickness);

/// Apparent modulus of a disc of radius R and thickness t bonded on both sides, incompressible [Gent1959]:
/// E (1 + 2 S^2), S = R/(2t). Approximate at small S.
double gent_lindley_modulus(double youngs_modulus, double radius, double thickness);

/// Force of a rigid sphere of radius R pressed by `depth` into an incompressible layer bonded below [Dimitriadis2002,
/// eq. 12]: 16/9 E sqrt(R) d^1.5 (1 + 1.133 x + 1.283 x^2 + 0.769 x^3 + 0.0975 x^4), where
/// x = sqrt(R d) / thickness. A series in x: 0.2 % low at 0.1, 1.1 % at 0.2, 2.7 % at 0.3.
double dimitriadis_force(double youngs_modulus, double radius, double thickness, double depth);

/// The same where the contact is much wider than the layer [Johnson1985, sec. 5.8]: the contact radius
/// a = 2 sqrt(R d), F = pi E a^6 / (96 R thickness^3). 15 % low at a = 10 thicknesses, 5 % at 20.
double thin_layer_force(double youngs_modulus, double radius, double thickness, double depth);

/// Surface compliance of a bonded layer over that of a half space, for pressure of wave number k, q = k * thickness:
/// M(q) = [(3-4nu) sinh 2q - 2q] / [(3-4nu) cosh 2q + 2q^2 + 5 - 12nu + 8nu^2].
double bonded_layer_kernel(double poisson_ratio, double q);

/// One of several layers that are bonded to each other; the innermost to a rigid base.
struct ElasticLayer {
  double thickness = 0.0;  ///< mm
  double youngs_modulus = 0.0;
  double poisson_ratio = 0.0;
};

/// Surface compliance of layers, listed from the outside inwards, for pressure of wave number k (1/mm), over that of a
/// half space of the outermost material. Love's function of each layer, (A + B z) exp(kz) + (C + D z) exp(-kz), is
/// matched at the interfaces (by the formulas of [Muki1960]; see [Johnson1985, appendix 3] for the plane analogue).
/// Equals bonded_layer_kernel for one layer.
double layered_kernel(std::span<const ElasticLayer> layers, double wave_number);

/// Frictionless contact of a rigid body of revolution with an endless layer bonded below.
struct LayerContact {
  double force = 0.0;           ///< N
  double contact_radius = 0.0;  ///< mm
};
/// A flat punch of `radius` pressed by `depth`. The dual integral equations are brought to a Fredholm equation of the
/// second kind with M's kernel [Lebedev1958] and solved by Gauss' rule: some 10 digits.
LayerContact flat_punch_on_layer(double youngs_modulus, double poisson_ratio, double thickness, double radius,
                                 double depth);
/// A smooth convex profile z = f(r), given by its slope f'(r), pressed by `depth`; the contact radius is where the
/// pressure ends without a jump, sought below `largest_radius`.
LayerContact profile_on_layer(double youngs_modulus, double poisson_ratio, double thickness,
                              const std::function<double(double)>& slope, double depth, double largest_radius);
/// A true sphere: profile_on_layer with f' = r / sqrt(R^2 - r^2).
LayerContact sphere_on_layer(double youngs_modulus, double poisson_ratio, double thickness, double radius,
                             double depth);
/// The same on several layers, from the outside inwards.
LayerContact sphere_on_layers(std::span<const ElasticLayer> layers, double radius, double depth);

}  // namespace touchstone::closed_forms
