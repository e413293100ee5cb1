#pragma once

#include <complex>
#include <cstddef>
#include <span>
#include <vector>

namespace touchstone::lab {

/// The discrete Fourier transform of a signal without its mean: amplitudes (of cosines, in the signal's unit) and
/// phases of the lines 0 to n/2; line k is at k rate / n. Line 0 is 0.
std::vector<std::complex<double>> spectral_lines(std::span<const double> signal);

/// The line of the largest amplitude. @pre not empty
std::size_t strongest_line(std::span<const std::complex<double>> lines);

}  // namespace touchstone::lab
