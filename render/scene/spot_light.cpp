#include "render/scene/spot_light.h"

#include <algorithm>
#include <cmath>

#include "core/units.h"

namespace touchstone::render {

double spot_profile(const SpotLamp& lamp, double cosine) {
  if (cosine >= std::cos(lamp.half_angle)) return 1.0;
  const double angle = std::acos(std::clamp(cosine, -1.0, 1.0));
  if (angle <= lamp.half_angle) return 1.0;
  if (angle >= lamp.half_angle + lamp.soft_angle) return 0.0;
  const double x = (lamp.half_angle + lamp.soft_angle - angle) / lamp.soft_angle;
  return x * x * (3.0 - 2.0 * x);
}

double spot_solid_angle(const SpotLamp& lamp) {
  const double hard = 4.0 * kPi * std::pow(std::sin(0.5 * lamp.half_angle), 2);  // = 2 pi (1 - cos)
  // The soft rim by Simpson's rule: a smooth integrand, exact to 1e-12 at this count.
  constexpr int kIntervals = 256;
  const double step = lamp.soft_angle / kIntervals;
  double rim = 0.0;
  for (int i = 0; i <= kIntervals; ++i) {
    const double x = 1.0 - static_cast<double>(i) / kIntervals;
    const double value = x * x * (3.0 - 2.0 * x) * std::sin(lamp.half_angle + i * step);
    rim += value * ((i == 0 || i == kIntervals) ? 1.0 : (i % 2 == 1 ? 4.0 : 2.0));
  }
  return hard + 2.0 * kPi * rim * step / 3.0;
}

}  // namespace touchstone::render
