#pragma once

#include <Eigen/Core>
#include <array>
#include <string>

namespace touchstone::render {

/// The most bands that a description may have.
inline constexpr int kMaxBands = 16;
/// The numbers of bands that the tracer is compiled for.
inline constexpr std::array kBandCounts = {1, 3, 8, 16};

/// One number per band, in a description: a scene has one of kBandCounts, whatever its author means by them; all
/// spectra of a scene have the same length. Coefficient-wise arithmetic; no allocation.
using Spectrum = Eigen::Array<double, Eigen::Dynamic, 1, 0, kMaxBands, 1>;

/// One number per band inside the tracer, where the count is known to the compiler.
template <int N>
using Bands = Eigen::Array<double, N, 1>;

/// The same value in each of `bands` bands.
inline Spectrum flat_spectrum(int bands, double value) {
  return Spectrum::Constant(bands, value);
}

/// @throws Error, naming `what`, unless there are `bands` values, all finite and from 0 to `most` (which may be
/// infinite). "the scene's environment" is said to have `bands`.
void check_spectrum(const Spectrum& values, Eigen::Index bands, double most, const std::string& what);

}  // namespace touchstone::render
