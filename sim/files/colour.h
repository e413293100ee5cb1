#pragma once
// Quantities that have a value in each spectral band, as files give them:
//
//   albedo: 0.8                             # the same in all bands
//   albedo: [0.8, 0.6, 0.5]                 # one number a band
//   albedo: ../spectra/silicone-white.csv   # a spectrum (render/spectra/spectral_curve.h); the device has `bands`
//   albedo: '#d6a58c'                       # a print of an sRGB colour (sim/files/srgb_reflectance.h); any device

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "core/yaml_reader.h"
#include "render/spectra/spectral_bands.h"

namespace touchstone::sim {

/// Numbers or a curve.
struct Colour {
  std::vector<double> numbers;                 ///< one for all bands, or one a band
  std::optional<render::SpectralCurve> curve;  ///< in the numbers' place
  bool smooth = false;                         ///< a curve that may be read at single wavelengths, where bands are such
  SourceLocation where;

  Colour() = default;
  Colour(double in_all_bands) : numbers{in_all_bands} {}
  Colour(std::initializer_list<double> of_each_band) : numbers(of_each_band) {}

  /// Of all numbers, or of the curve.
  double largest() const;
};

/// Reads any of the four forms. A spectrum is one of shares where `allowed` ends at 1, else of coefficients per mm.
void read_value(YamlReader& in, Colour& colour, Allowed allowed);

/// The bands of a scene: narrow ranges that curves are averaged over, or just wavelengths that numbers are given for.
struct SceneBands {
  render::Spectrum centres_nm;
  std::optional<render::SpectralBands> ranges;

  int count() const { return static_cast<int>(centres_nm.size()); }
};

/// @throws Error that names `what`, its file and line, if the colour has another number of bands, or is a curve where
/// the bands aren't ranges
render::Spectrum in_bands(const Colour& colour, const SceneBands& bands, const char* what);

/// Names of a picture's channels, one a band: R, G, B for three wavelengths that fall, Y for one, else in the layout
/// of spectral EXR files [Fichet2021]: "S0.550,3nm".
std::vector<std::string> channel_names(const SceneBands& bands);

/// For viewers: red, green and blue, 0 to 1.
Eigen::Vector3d display_colour(const Colour& colour);

}  // namespace touchstone::sim
