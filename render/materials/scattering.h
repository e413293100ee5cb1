#pragma once
// Homogeneous scattering media: milky silicone, a half-transparent membrane, a cloudy liquid.
//
//   Medium milky{1.41, absorption, scattering, 0.8};    // coefficients per mm in each band, mean cosine 0.8
//
// Between two events a photon flies a distance of density sigma_t exp(-sigma_t d), sigma_t = absorption + scattering;
// then the share scattering / sigma_t of it goes on in a new direction by Henyey and Greenstein's phase function
// [Henyey1941]
//   p(cos) = (1 - g^2) / (4 pi (1 + g^2 - 2 g cos)^(3/2)),
// whose mean cosine is g: 0 is the same to all sides, 0.9 is what fine particles in silicone do, below 0 throws light
// back. Any number of scatterings is followed; RenderSettings::max_depth doesn't count them. Without interreflection
// only light is seen that was scattered once, straight from a lamp; a preview takes a medium as if it only absorbed.
//
// Where a medium absorbs next to nothing and is wide, walks cross it in jumps (deep_walk.h).
//
// One path carries all bands although each has its own mean free path. The distance is drawn for one band, chosen in
// proportion to what the path carries in it, and the result is weighted by the density over all choices (the balance
// heuristic of [Veach1997] over bands; [Chiang2016]). So the sum of a path's bands never grows at an event, and bands
// whose coefficients differ by orders of magnitude give no fireflies.

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

#include "core/units.h"
#include "render/spectra/spectrum.h"

namespace touchstone::render {

/// Henyey and Greenstein's phase function (1/sr, its integral over the sphere is one) at the cosine between the
/// directions before and after, for a mean cosine g, |g| < 1.
inline double henyey_greenstein(double cosine, double g) {
  const double d = 1.0 + g * g - 2.0 * g * cosine;
  return (1.0 - g * g) / (4.0 * kPi * d * std::sqrt(d));
}

/// A cosine with that density, from u in [0, 1). With x = 2u - 1 and q = (x + g) / (1 + g x) the inverse of the
/// distribution is q + g (1 - q^2) / 2: the usual formula without its division by g.
inline double sample_henyey_greenstein(double g, double u) {
  const double x = 2.0 * u - 1.0;
  const double q = (x + g) / (1.0 + g * x);
  return std::clamp(q + 0.5 * g * (1.0 - q * q), -1.0, 1.0);
}

/// How far a path flies before it would meet a particle (mm, may be infinite), and the chance with which each band was
/// the one to decide that.
template <int N>
struct Flight {
  double distance;
  Bands<N> chance;
};

/// Draws the flight of a path that carries `throughput` (some band above 0) from two numbers in [0, 1).
template <int N>
Flight<N> sample_flight(const Bands<N>& extinction, const Bands<N>& throughput, double u, double v) {
  Flight<N> flight{0.0, throughput / throughput.sum()};
  int band = 0;
  for (double rest = u; band + 1 < N && rest >= flight.chance[band]; ++band) rest -= flight.chance[band];
  while (band > 0 && !(flight.chance[band] > 0.0)) --band;  // rounding may have run past the last
  flight.distance =
      extinction[band] > 0.0 ? -std::log1p(-v) / extinction[band] : std::numeric_limits<double>::infinity();
  return flight;
}

/// Factor on the throughput of a path that came through `distance` without meeting a particle.
template <int N>
Bands<N> weight_of_passing(const Bands<N>& extinction, const Flight<N>& flight, double distance) {
  Bands<N> left = Bands<N>::Ones();  // a band of no extinction passes even an endless path
  for (int band = 0; band < N; ++band) {
    if (extinction[band] > 0.0) left[band] = std::exp(-extinction[band] * distance);
  }
  return left / (flight.chance * left).sum();
}

/// Factor on the throughput of a path that met a particle after `flight.distance` and is scattered.
template <int N>
Bands<N> weight_of_scattering(const Bands<N>& extinction, const Bands<N>& scattering, const Flight<N>& flight) {
  const Bands<N> left = (-extinction * flight.distance).exp();
  return scattering * left / (flight.chance * extinction * left).sum();
}

/// A walk in a medium that takes nothing away may last for ever: the chance to be still inside a half space after n
/// scatterings falls as n^(-1/2). So from kFreeScatterings on, each time their count has doubled, some walks end and
/// the others go on with more weight: no bias. Up to 2^10 times that count a share of 2^(-1/2) is kept, so that the
/// weights grow no faster than the walks become rare and none is a firefly; that is as long as walks
/// last in a layer of some 8,000 mean free paths. Beyond a half is kept, and the mean length is finite.
inline constexpr std::int64_t kFreeScatterings = 65536;
/// Is a walk of so many scatterings to be ended by chance now? At kFreeScatterings and each time that it has doubled.
inline bool roulette_is_due(std::int64_t scatterings) {
  return scatterings >= kFreeScatterings && (scatterings & (scatterings - 1)) == 0;
}
/// @pre roulette_is_due(scatterings)
inline double share_of_walks_kept(std::int64_t scatterings) {
  return scatterings <= (kFreeScatterings << 10) ? std::numbers::sqrt2 / 2.0 : 0.5;
}

}  // namespace touchstone::render
