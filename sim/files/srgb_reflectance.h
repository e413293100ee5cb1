#pragma once
// What a print of an sRGB colour reflects at each wavelength.
//
// Many spectra look alike; which one a printer's inks have isn't in a picture's file. Here the eight corners of the
// sRGB cube get the smoothest spectra of a simple family, s = 1/2 + c / (2 sqrt(1 + c^2)) with c quadratic in the
// wavelength [Jakob2019], which under D65 look exactly like the corner; and a colour is their mix by the shares with
// which independent halftones of its parts of red, green and blue would cover the paper (Demichel's equations
// [Neugebauer1937]). The mix is trilinear in those parts, as tristimulus values are, so every colour looks under D65
// exactly as its sRGB values say.

#include <Eigen/Core>
#include <array>

#include "render/spectra/spectral_curve.h"

namespace touchstone::sim {

/// Shares of the eight corners in a colour of linear sRGB parts 0 to 1: bit 0 of the index is red, 1 green, 2 blue.
std::array<double, 8> corner_shares(const Eigen::Vector3d& linear);

/// The corners' reflectances from 380 to 780 nm, 0 to 1; the first is 0 everywhere, the last 1.
const std::array<render::SpectralCurve, 8>& corner_reflectances();

/// Of one colour, sRGB, 0 to 1.
render::SpectralCurve srgb_reflectance(const Eigen::Vector3d& srgb);

/// The same colour of one ink, not of a halftone of eight: the one spectrum of the family that looks like it under D65.
/// Under other light, or to a camera, the two differ.
render::SpectralCurve single_ink_reflectance(const Eigen::Vector3d& srgb);

/// XYZ of a reflectance under D65 for the 2 degree observer; of 1 everywhere it is kD65White. Colour matching functions
/// by the fits of [Wyman2013], D65 by the table of [CIE15].
Eigen::Vector3d xyz_under_d65(const render::SpectralCurve& reflectance);

}  // namespace touchstone::sim
