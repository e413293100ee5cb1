#pragma once
// Long paths through dense media in few steps: a random walk far from everything is replaced by its first passage of a
// sphere round it (walk on spheres [Muller1956]).
//
// Far from all boundaries light in a medium that absorbs next to nothing is diffuse: averaged over directions it is a
// function phi that solves phi'' = kappa^2 phi, kappa^2 = 3 sigma_a / l, with the transport mean free path
// l = 1 / (sigma_a + (1 - g) sigma_s). So phi at a sphere's centre is its mean over the sphere times
// kappa R / sinh(kappa R). A walk that has just met a particle at x on its path along d stands for phi at x + g l d.
// Its next place is then anywhere on the sphere, with any direction.
//
// Without absorption and for even scattering this is exact up to what boundaries and lamps leave within the
// margin, exp(-kJumpMargin) of their light: any harmonic phi, with its directions, solves the transport equation.
// Otherwise it leaves out terms of (l / R)^2, at most 1 / kJumpMargin^2, where the light isn't isotropic, and an error
// of kappa by the order of sigma_a l, at most kMostAbsorbed / 2. All bands jump together, by the margin of the one of
// the longest path; where one of them hardly scatters or absorbs more there are no jumps.

#include <Eigen/Core>
#include <cmath>
#include <limits>

#include "core/units.h"
#include "render/spectra/spectrum.h"

namespace touchstone::render {

inline constexpr double kJumpMargin = 10.0;    ///< to stay away from things, in transport (or longer) mean free paths
inline constexpr double kMostAbsorbed = 1e-3;  ///< sigma_a l, above which walks aren't long anyway
inline constexpr int kJumpEvery = 16;          ///< scatterings between two checks for free space

/// What jumps in a medium need: `margin` in mm, infinite where there are none, and kappa in 1/mm of each band.
template <int N>
struct DeepWalk {
  double margin = std::numeric_limits<double>::infinity();
  Bands<N> kappa = Bands<N>::Zero();
  Bands<N> drift = Bands<N>::Zero();  ///< g l, mm
};

/// For a medium with these coefficients (per mm) and mean cosine g. The margin is infinite where the medium absorbs
/// more than the walk allows.
template <int N>
DeepWalk<N> deep_walk(const Bands<N>& absorption, const Bands<N>& scattering, double g) {
  DeepWalk<N> walk;
  const Bands<N> transport = absorption + (1.0 - g) * scattering;
  if (!(transport.minCoeff() > 0.0) || ((absorption > kMostAbsorbed * transport).any())) return walk;
  const Bands<N> free_path = 1.0 / transport.min(absorption + scattering);
  walk.margin = kJumpMargin * free_path.maxCoeff();
  walk.kappa = (3.0 * absorption * transport).sqrt();
  walk.drift = g / transport;
  return walk;
}

/// Share of each band's light that reaches a sphere of radius R (mm) from its centre: kappa R / sinh(kappa R).
template <int N>
Bands<N> share_left(const DeepWalk<N>& walk, double radius) {
  Bands<N> left = Bands<N>::Ones();
  for (int band = 0; band < N; ++band) {
    const double x = walk.kappa[band] * radius;
    if (x > 1e-6) left[band] = 2.0 * x * std::exp(-x) / -std::expm1(-2.0 * x);
  }
  return left;
}

/// An even direction from two numbers in [0, 1).
inline Eigen::Vector3d square_to_sphere(double u, double v) {
  const double z = 1.0 - 2.0 * u;
  const double radius = std::sqrt(std::max(0.0, 1.0 - z * z));
  return {radius * std::cos(2.0 * kPi * v), radius * std::sin(2.0 * kPi * v), z};
}

}  // namespace touchstone::render
