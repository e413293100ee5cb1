#pragma once
// The four spectra of [Lin2019, fig. 2]: white layer and magenta marker, each beside the yellow film and behind it, as
// light that reaches the camera.
//
// The device is sheared by half a marker, so that a marker stands half behind its film and half beside it: then one
// picture has all four. They are path-traced, with all bounced light and its colour, and held against the products of
// the device's own curves.
//
// What is compared. What falls on the white layer isn't the lamps' light: some of it has passed films, and much of it
// was bounced by coloured things before. No product of curves knows how much. So light as it leaves the white layer
// beside the film, as rendered, is taken for what falls there, divided by white's curve; the three other spectra should
// then be that times magenta's curve, times the film's (it passes the film once on its path out), and times both.
// Products are of the curves at every nanometre, weighted by the lamps' light and then averaged over a band; the
// rendering multiplies the curves' means. So the error has in it what bands leave out, what stands by a marker and
// colours its light, and the slant at which films are seen. How far the light itself is off the lamps' is given
// separately.

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>

#include "plots/line_plot.h"
#include "render/spectra/spectral_bands.h"
#include "sim/scene/device.h"

namespace touchstone::lab {

/// A colour as the device's camera has it: HSV of its red, green and blue after white balance.
struct SeenHue {
  double hue_deg = 0.0;  ///< -180 to 180, 0 is red
  double saturation = 0.0;
};

/// One of the four. Spectra are the bands' parts of the whole: they add up to 1.
struct ChromaSpectrum {
  std::string name;           ///< "white", "magenta", "yellow", "red"
  render::Spectrum rendered;  ///< irradiance on the sensor
  render::Spectrum product;   ///< of curves, see above; white's is that of lamp and white layer
  double error = 0.0;         ///< sum of |rendered - product|
  SeenHue rendered_hue;
  SeenHue product_hue;  ///< of the products with the lamps' own light: what the paper's fig. 2 has in mind
};

/// Layer, marker, and each of them behind the film: yellow is the white layer, red the magenta marker.
enum class ChromaColour { white, magenta, yellow, red };

/// The four spectra, in the same bands.
struct ChromaSpectra {
  render::SpectralBands bands;
  std::array<ChromaSpectrum, 4> colours;  ///< by ChromaColour
  const ChromaSpectrum& of(ChromaColour colour) const { return colours[static_cast<std::size_t>(colour)]; }
};

/// Renders the places round the four markers nearest to the middle, `samples` paths a pixel.
/// The device's lamps must share one spectrum.
/// @throws Error unless the device has bands, a camera, lamps with a spectrum, a matt coating with square markers, and
/// films, all by curves, and shows each of the four where it's looked for: markers 1 mm wide and more, white between
/// them, and films that leave half of a marker free
ChromaSpectra measure_chroma_spectra(const sim::DeviceSpec& device, const std::filesystem::path& cache, int samples,
                                     std::uint64_t seed);

/// Light a nanometre over wavelength, the rendered ones and, dashed, the products.
plots::LinePlot plot_of(const ChromaSpectra& spectra);

}  // namespace touchstone::lab
