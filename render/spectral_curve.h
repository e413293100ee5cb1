#pragma once
// Spectra as curves over wavelength, and what a scene's bands make of them.
//
// A path carries all bands at once, each with one number per spectrum: the mean of the curve over the band. So a
// product of curves (lamp, film twice, pigment, camera) is right as long as at most one of them varies much within a
// band: with three bands over the visible range, yellow film twice over magenta errs by a quarter and more in blue,
// with 16 by 5 %.

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "render/spectrum.h"

namespace touchstone::render {

/// A function of wavelength, given at points and linear between them; beyond the first and the last one it keeps their
/// values. Wavelengths in nm (vacuum), rising.
struct SpectralCurve {
  std::vector<double> wavelengths_nm;
  std::vector<double> values;
  std::string source;  ///< where it comes from, for people

  /// @pre at least one point
  double at(double wavelength_nm) const;
  /// Exact integral of the piecewise linear curve. @pre from_nm <= to_nm
  double integral(double from_nm, double to_nm) const;
  /// The mean over a range, or the value where the range is a point.
  double mean(double from_nm, double to_nm) const;
};

/// What a curve's values may be.
enum class CurveKind {
  share,     ///< of light: reflectance, transmittance, quantum efficiency; 0 to 1
  relative,  ///< a lamp's emission in any unit; at least 0, not all 0
  per_mm,    ///< absorption or scattering; at least 0
};

/// Reads a CSV file. Lines that begin with '#' are comments; one of them must be "# source: ...", which tells where the
/// figures are from. Then a header of two names, the first of them `wavelength_nm`, and a row "wavelength,value" a
/// line, wavelengths rising, from 100 to 10,000 nm; at least two rows.
/// @throws Error that names file, line, value and what is allowed
SpectralCurve read_spectral_curve(const std::filesystem::path& file, CurveKind kind);

/// Bands that lie side by side: band k is from edges_nm[k] to edges_nm[k + 1].
struct SpectralBands {
  std::vector<double> edges_nm;

  int count() const { return static_cast<int>(edges_nm.size()) - 1; }
  /// Middles of the bands, nm: what stands for a band's photons (h c / lambda).
  Spectrum centres_nm() const;
};

/// `count` bands of equal width. @throws Error unless 0 < from < to and 1 <= count <= kMaxBands
SpectralBands even_bands(double from_nm, double to_nm, int count);

/// The mean of a curve over each band: for reflectances, transmittances, efficiencies and coefficients.
Spectrum band_means(const SpectralCurve& curve, const SpectralBands& bands);

/// What each band gets of a lamp that radiates `power_W` in all, over all wavelengths of its curve. Light outside of
/// the bands is lost: the sum is at most `power_W`. @throws Error if nothing of it is in the bands
Spectrum band_powers(const SpectralCurve& emission, double power_W, const SpectralBands& bands);

/// How far the bands get a product of curves wrong: max over k of |mean of the product - product of the means|, over
/// the largest mean of the product; both by the curves' own points. 0 for one curve. What the plan needs to choose a
/// count.
double band_product_error(std::span<const SpectralCurve> curves, const SpectralBands& bands);

/// The fewest of 1, 3, 8 and 16 even bands whose error for each of the products is at most `tolerance`; 16 if none is.
int bands_needed(std::span<const std::vector<SpectralCurve>> products, double from_nm, double to_nm, double tolerance);

}  // namespace touchstone::render
