#pragma once
// How bright a camera shows what is so bright: the last step from linear numbers to those that it delivers.

#include <variant>

#include "core/monotone_curve.h"

namespace touchstone::render {

/// A number in proportion to the light is delivered as it is.
struct LinearTone {};
/// The transfer function of sRGB [IEC61966]: 12.92 x to x = 0.0031308, then 1.055 x^(1/2.4) - 0.055.
struct SrgbTone {};
/// x^(1/gamma).
struct GammaTone {
  double gamma = 2.2;
};

/// From linear, 0 to 1 of full scale, to delivered, 0 to 1 of full scale; of measured points a curve that rises.
using ToneCurve = std::variant<LinearTone, SrgbTone, GammaTone, MonotoneCurve>;

/// @throws Error for a gamma that isn't from 0.1 to 10, or points that don't rise or don't go from x = 0 to x = 1 with
/// y from 0 to 1
void check(const ToneCurve& curve);

/// What is delivered of `linear`, at least 0; above 1 the curve goes on. Rises with it.
double delivered(const ToneCurve& curve, double linear);

/// The inverse: what is delivered as this; 0 for less than the curve ever gives. For at most 1.
double linear_of(const ToneCurve& curve, double delivered);

}  // namespace touchstone::render
