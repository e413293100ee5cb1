#pragma once
// The reflex device's chip, seeing one band of light.

#include "render/imager/imager_presets.h"
#include "render/imager/motion_chip.h"

namespace touchstone::test {

inline render::MotionChipSettings one_band_chip() {
  render::MotionChipSettings made;
  made.imager = render::adns2620_preset(620e-6).imager;
  made.imager.wavelengths_nm = render::Spectrum::Constant(1, 640.0);
  made.imager.quantum_efficiency = render::QuantumEfficiency::Constant(1, 1, 0.45);
  return made;
}

inline constexpr double kFullLight_DN = 63.0;

/// W/m^2 that make the number 63.
inline double full_light(const render::MotionChipSettings& chip) {
  const double electrons = (kFullLight_DN - chip.imager.black_level_DN) / chip.imager.gain_DN_per_e;
  return electrons / response_of(chip.imager).electrons_per_irradiance(0, 0);
}

}  // namespace touchstone::test
