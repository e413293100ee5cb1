#include "lab/vhs/pinhole_transfer.h"

#include <cmath>

#include "core/error.h"
#include "core/units.h"

namespace touchstone::lab {
namespace {

double pixel_transfer(const PinholeOptics& optics, double frequency) {
  const double x = kPi * optics.pixel_mm * on_sensor(optics, frequency);
  return std::abs(x) < 1e-9 ? 1.0 : std::sin(x) / x;
}

}  // namespace

double on_sensor(const PinholeOptics& optics, double frequency) {
  return frequency * optics.to_object_mm / optics.to_sensor_mm;
}

double transfer_of_disc(const PinholeOptics& optics, double frequency) {
  const double blur = optics.hole_mm * (1.0 + optics.to_object_mm / optics.to_sensor_mm);
  const double u = kPi * blur * frequency;
  const double disc = u < 1e-9 ? 1.0 : 2.0 * std::cyl_bessel_j(1.0, u) / u;
  return disc * pixel_transfer(optics, frequency);
}

double transfer_with_diffraction(const PinholeOptics& optics, double frequency, double wavelength_nm) {
  constexpr int kSteps = 4000;
  constexpr double kMmPerNm = 1e-6;
  const double a = 0.5 * optics.hole_mm;
  const double wavelength = wavelength_nm * kMmPerNm;
  const double half_shift = 0.5 * wavelength * optics.to_object_mm * frequency;
  if (half_shift >= a) return 0.0;
  // Over the two pupils' common area the phases' difference goes evenly across, one period in 1 / rate.
  const double rate = frequency * (1.0 + optics.to_object_mm / optics.to_sensor_mm);
  const double width = a - half_shift;
  double sum = 0.0;
  for (int k = 0; k < kSteps; ++k) {
    const double x = width * (k + 0.5) / kSteps;
    sum += std::sqrt(a * a - (x + half_shift) * (x + half_shift)) * std::cos(2.0 * kPi * rate * x);
  }
  return 4.0 * sum * width / kSteps / (kPi * a * a) * pixel_transfer(optics, frequency);
}

}  // namespace touchstone::lab
