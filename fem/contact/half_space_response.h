#pragma once
// A half-space's displacement by a traction at a point of its surface [Johnson1985, eqs. 3.19, 3.75].

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "fem/elements/elastic_material.h"

namespace touchstone::fem {

/// What the response at (x, y) mm along the tangents is made of, over its scale, with the mean `inverse` of 1/r: of a
/// normal traction by a normal one, along either tangent by a normal one, and what tangential ones have beyond the
/// first. Plain arithmetic, for loops over many points.
struct ResponseTerms {
  /// `nu` is Poisson's ratio, `inverse` in 1/mm.
  ResponseTerms(double nu, double x, double y, double inverse) {
    const double flat2 = x * x + y * y;
    const double over_flat2 = 1.0 / (flat2 > 1e-100 ? flat2 : 1e-100);
    const double square = flat2 * (inverse * inverse);
    const double shear = (0.5 - nu) * (square < 1.0 ? square : 1.0) * over_flat2;
    const double along = nu * inverse * over_flat2;
    normal = (1.0 - nu) * inverse;
    first = shear * x;
    second = shear * y;
    first_first = along * (x * x);
    first_second = along * x * y;
    second_second = along * (y * y);
  }

  double normal, first, second, first_first, first_second, second_second;
};

/// In the axes (into the body, first, second tangent). On a gel that is thin beside its edges the response fades as
/// exp(-r / 0.4 thickness): a load acts about as far on a bonded layer, for the transform of exp(-r / l) / r,
/// 1 / sqrt(k^2 + 1 / l^2), goes as the layer's kernel over k. It stays positive definite, being the product of two
/// that are. It sets in gradually from four edges to three: the edge is the mean of those in contact, and a force
/// mustn't jump as that grows.
struct HalfSpaceResponse {
  /// `thickness` and `edge`, mm: of the gel, and of its surface's triangles in contact.
  HalfSpaceResponse(const ElasticMaterial& material, double thickness, double edge)
      : scale(1.0 / (2.0 * std::numbers::pi * shear_modulus(material))),
        nu(material.poisson_ratio),
        fade(std::clamp(kThin - thickness / edge, 0.0, 1.0) / (kFades * thickness)) {}

  double faded(double r) const { return fade > 0.0 ? std::exp(-fade * r) : 1.0; }

  /// mm/N, at a point that is (x, y) mm along the tangents and the root of `r2` > 0 in all from where the traction is.
  Eigen::Matrix3d between(double x, double y, double r2) const {
    const double k = 1.0 / std::sqrt(r2);
    Eigen::Matrix3d u;
    const double flat2 = x * x + y * y;
    const double shear = flat2 > 0.0 ? (0.5 - nu) * std::min(1.0, flat2 * k * k) / flat2 : 0.0;
    const double along = flat2 > 0.0 ? nu * k / flat2 : 0.0;
    u << (1.0 - nu) * k, shear * x, shear * y,                                                     //
        -shear * x, (1.0 - nu) * k + (flat2 > 0.0 ? along * x * x : 0.5 * nu * k), along * x * y,  //
        -shear * y, along * x * y, (1.0 - nu) * k + (flat2 > 0.0 ? along * y * y : 0.5 * nu * k);
    return scale * faded(std::sqrt(r2)) * u;
  }

  double scale;  ///< 1/MPa
  double nu;
  double fade;  ///< 1/mm; 0: it doesn't

 private:
  static constexpr double kThin = 4.0;   // edges: under a gel thinner than this the base acts among the hats
  static constexpr double kFades = 0.4;  // of the thickness: how far a load acts on a thin layer
};

}  // namespace touchstone::fem
