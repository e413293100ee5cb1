#pragma once
// How much of two rough faces really touches.

#include <optional>

#include "fem/elements/elastic_material.h"

namespace touchstone::fem {

/// E* of two elastic faces, 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2, MPa; without `other` the other face is rigid.
double contact_modulus(const ElasticMaterial& material, const std::optional<ElasticMaterial>& other = std::nullopt);

/// The share of the nominal area that is in real contact under a mean pressure (MPa): erf(sqrt(2) p / (E* h')), h'
/// being the RMS slope of both faces' roughness together ([Persson2001], for random self-affine faces: his diffusion of
/// pressure, ended at the finest roughness). Elastic, without friction and adhesion; 1.6 p / (E* h') at low pressure, 1
/// at high. h' = 0: smooth faces touch wholly wherever they press.
/// @pre pressure >= 0, modulus > 0, slope >= 0
double real_contact_share(double pressure, double contact_modulus, double rms_slope);

}  // namespace touchstone::fem
