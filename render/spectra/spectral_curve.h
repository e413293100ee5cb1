#pragma once
// Spectra as curves over wavelength. spectral_bands.h makes numbers of them.

#include <filesystem>
#include <string>
#include <vector>

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

/// What a lamp of this measured emission sends at a wavelength: nothing beyond the curve's points.
double emitted_at(const SpectralCurve& emission, double wavelength_nm);

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

}  // namespace touchstone::render
