#include "render/imager/tone_curve.h"

#include <cmath>

#include "core/cie_colour.h"
#include "core/error.h"
#include "core/overloaded.h"

namespace touchstone::render {

void check(const ToneCurve& curve) {
  if (const auto* power = std::get_if<GammaTone>(&curve)) {
    if (!(power->gamma >= 0.1 && power->gamma <= 10.0)) {
      fail("tone curve: gamma is {}; allowed is from 0.1 to 10", power->gamma);
    }
  }
  const auto* measured = std::get_if<MonotoneCurve>(&curve);
  if (measured == nullptr) return;
  const auto& points = measured->points();
  if (points.front().x() != 0.0 || points.back().x() != 1.0) {
    fail("tone curve: its points go from {} to {}; they must go from 0 to 1 (full scale)", points.front().x(),
         points.back().x());
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double y = points[i].y();
    if (!(y >= 0.0 && y <= 1.0)) fail("tone curve: point {} delivers {}; allowed is from 0 to 1", i + 1, y);
    if (i > 0 && !(y > points[i - 1].y())) {
      fail("tone curve: point {} delivers {}; it must be above that of the point before it, {}", i + 1, y,
           points[i - 1].y());
    }
  }
}

double delivered(const ToneCurve& curve, double linear) {
  return std::visit(
      Overloaded{[&](const LinearTone&) { return linear; }, [&](const SrgbTone&) { return srgb_from_linear(linear); },
                 [&](const GammaTone& power) { return std::pow(linear, 1.0 / power.gamma); },
                 [&](const MonotoneCurve& measured) { return measured.at(linear); }},
      curve);
}

double linear_of(const ToneCurve& curve, double wanted) {
  if (std::holds_alternative<LinearTone>(curve)) return wanted;
  double low = 0.0;
  double high = 1.0;
  if (delivered(curve, low) >= wanted) return low;
  if (delivered(curve, high) <= wanted) return high;
  constexpr int kHalvings = 52;  // of a double
  for (int k = 0; k < kHalvings; ++k) {
    const double middle = 0.5 * (low + high);
    (delivered(curve, middle) < wanted ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace touchstone::render
