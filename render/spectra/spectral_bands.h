#pragma once
// The bands of a scene: what its spectra become when one path carries all of them as one number a band.
//
// In a band a lamp has its exact power, and all else (reflectance, transmittance, efficiency, coefficient) its mean
// over the band, weighted by the lamps' light. What a pixel reads of one lamp is then exact where only one thing on the
// path varies within a band, and wrong by the things' covariance where several do: steep edges of a filter hurt, as do
// wide bands. So the bands' edges are put where the covariance is least, by dynamic programming over all ways to cut
// the range (adapted_bands). On the path of a white LED's light through yellow film, off magenta print, back through
// the film and into a colour pixel, sixteen such bands err by at most 0.8 %, eight by 3.2 %; sixteen even ones err
// by 3.3 % and three by 42 %.

#include <optional>
#include <span>
#include <vector>

#include "render/spectra/spectral_curve.h"
#include "render/spectra/spectrum.h"

namespace touchstone::render {

/// Bands that lie side by side: band k is from edges_nm[k] to edges_nm[k + 1].
struct SpectralBands {
  std::vector<double> edges_nm;
  std::optional<SpectralCurve> weight;  ///< of the wavelengths within a band: the lamps' light. None: all alike

  int count() const { return static_cast<int>(edges_nm.size()) - 1; }
  /// Middles of the bands, nm: what stands for a band's photons (h c / lambda). With a weight, its centre of gravity.
  Spectrum centres_nm() const;
};

/// `count` bands of equal width. @throws Error unless 0 < from < to and 1 <= count <= kMaxBands
SpectralBands even_bands(double from_nm, double to_nm, int count);

/// The weighted mean of a curve over each band: for reflectances, transmittances, efficiencies and coefficients. Where
/// a band has no light at all, the plain mean.
Spectrum band_means(const SpectralCurve& curve, const SpectralBands& bands);

/// What each band gets of a lamp that radiates `power_W` in all, over all wavelengths of its curve. Light outside of
/// the bands is lost: the sum is at most `power_W`. @throws Error if nothing of it is in the bands
Spectrum band_powers(const SpectralCurve& emission, double power_W, const SpectralBands& bands);

/// Light on its path: emitted by a lamp, then weakened by each factor in turn (a film twice is two factors), the last
/// one being the camera's efficiency.
struct SpectralPath {
  SpectralCurve emission;
  std::vector<SpectralCurve> factors;
};

/// How far the bands get what a pixel reads of a path wrong, relative: sum over the bands of |approximate - exact| over
/// the exact sum; 0 where nothing arrives. Curves are sampled every nanometre.
double band_error(const SpectralPath& path, const SpectralBands& bands);

/// `count` bands whose edges (on whole steps of some 2 nm) make the sum of the paths' errors least.
/// @throws Error as even_bands, or if the range is narrower than two steps a band
SpectralBands adapted_bands(std::span<const SpectralPath> paths, const std::optional<SpectralCurve>& weight,
                            double from_nm, double to_nm, int count);

/// Adapted bands, the fewest of `counts` (rising) with no path's error above `tolerance`; the last count if none is so
/// good. @pre `counts` isn't empty
SpectralBands bands_within(std::span<const SpectralPath> paths, const std::optional<SpectralCurve>& weight,
                           double from_nm, double to_nm, double tolerance, std::span<const int> counts);

}  // namespace touchstone::render
