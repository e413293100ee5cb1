#pragma once
// Steady vibration of the gel under a body that sticks to a patch of its surface.
//
// With Poisson's ratio constant in time the stiffness is K s(omega), s = E*(omega) / E0 (complex_modulus), so the real
// modes of E0 serve at every frequency, and the dynamic compliance is
//   H(omega) = H0 / s + sum_k w_k w_k^T omega^2 / (s omega_k^2 (s omega_k^2 - omega^2)),
// H0 the static compliance, w_k the mode as the surface (or a bead) sees it: static correction by mode acceleration
// [Cornwell1983]. What is left out are modes above the last,
// each with its static part already in H0: their error falls with (omega / omega_last)^2 and is bounded beside every
// answer. Time goes as exp(i omega t); amplitudes are complex.

#include <Eigen/Core>
#include <complex>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "fem/contact/cut_hats.h"
#include "fem/contact/relaxation.h"
#include "fem/elements/compliance.h"

namespace touchstone::fem {

/// The gel's lowest modes, of the modulus E0, as contact sees them: rows as in Compliance.
struct GelVibration {
  Eigen::VectorXd angular_frequency;  ///< k, rad/s, rising
  Eigen::MatrixXd surface;            ///< 3n x k: int phi_i u_a dA, mm^2 tonne^-1/2
  Eigen::MatrixXd beads;              ///< 3m x k: mean over a bead's surface, tonne^-1/2
  Eigen::MatrixXd effective_mass;  ///< 3 x k: the part of `mass` that follows the mode when the plate shakes along an
                                   ///< axis, tonne
  double mass = 0.0;               ///< of the gel, tonne
  std::string note;                ///< from the cache: empty, or what was wrong with the file there
};

/// The `count` lowest modes of the gel that compute_compliance makes of the same arguments. `density` in tonne/mm^3
/// (1e-12 per kg/m^3). Beads have the gel's own density: nine steel beads of 0.5 mm would add 0.2 % to the vhs gel.
/// With `held`, vertices of the surface that a body at rest sticks to (see lowest_eigenmodes), they are the modes under
/// that body; StuckPatch wants those of the free gel.
/// @throws Error as lowest_eigenmodes and compute_compliance do
GelVibration compute_vibration(const TetMesh& mesh, std::span<const ElasticMaterial> materials,
                               std::span<const Bead> beads, double density, int count, std::span<const int> held = {});
GelVibration compute_vibration(const TetMesh& mesh, const ElasticMaterial& material, std::span<const Bead> beads,
                               double density, int count, std::span<const int> held = {});  ///< the same in all regions

/// Lowest frequency (Hz) of a wide layer of this thickness (mm), bonded below: a quarter of a shear wave,
/// sqrt(G / rho) / (4 h). A slab with free sides is softer: on 4 thicknesses square its lowest is some percent lower.
double layer_shear_frequency(const ElasticMaterial& material, double density, double thickness);

/// Complex amplitudes.
struct SteadyVibration {
  Eigen::Vector3cd force = Eigen::Vector3cd::Zero();  ///< on the body, N
  Eigen::MatrixX3cd traction;                         ///< n x 3, on the gel, MPa
  Eigen::MatrixX3cd surface_weighted;                 ///< n x 3, int phi_i u dA, mm^3
  Eigen::MatrixX3cd bead_displacement;                ///< m x 3, mm
  double truncation = 0.0;  ///< relative error of the force by the modes left out, to first order a bound; infinite
                            ///< from the last mode on
};

/// A rigid body that sticks to the given surface vertices and shakes without turning.
class StuckPatch {
 public:
  /// The gel and its vibration must outlive this. `vertices` rise. `cuts`: what the body's outline makes of their hats
  /// (PressState::cuts); null: they are whole. @throws Error if there is no vertex
  StuckPatch(const Compliance& gel, const GelVibration& vibration, std::vector<int> vertices,
             const CutHats* cuts = nullptr);
  ~StuckPatch();
  StuckPatch(StuckPatch&&) noexcept;
  StuckPatch& operator=(StuckPatch&&) noexcept;

  /// The answer to the body's displacement amplitude * exp(i omega t). mm, omega >= 0 in rad/s. Near a resonance of the
  /// gel under the body that nothing damps the amplitudes grow as 1 / (omega_h^2 - omega^2).
  /// @throws Error that names the frequency, at such a resonance (to some ten digits): there is no steady answer
  SteadyVibration answer(const Eigen::Vector3d& amplitude, double angular_frequency,
                         const PronySeries& relaxation) const;
  /// The same without inertia: what a quasi-static press takes for it.
  SteadyVibration without_inertia(const Eigen::Vector3d& amplitude, double angular_frequency,
                                  const PronySeries& relaxation) const;

 private:
  struct Parts;
  std::unique_ptr<const Parts> parts_;
};

}  // namespace touchstone::fem
