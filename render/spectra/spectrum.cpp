#include "render/spectra/spectrum.h"

#include <cmath>

#include "core/error.h"

namespace touchstone::render {

void check_spectrum(const Spectrum& values, Eigen::Index bands, double most, const std::string& what) {
  if (values.size() != bands) {
    fail("{} has {} bands; the scene's environment has {}", what, values.size(), bands);
  }
  for (Eigen::Index i = 0; i < bands; ++i) {
    if (!(values[i] >= 0.0 && values[i] <= most)) {
      if (std::isinf(most)) fail("{} is {} in band {}; it must be finite and 0 or more", what, values[i], i);
      fail("{} is {} in band {}; it must be from 0 to {}", what, values[i], i, most);
    }
    if (!std::isfinite(values[i])) fail("{} is {} in band {}; it must be finite", what, values[i], i);
  }
}

}  // namespace touchstone::render
