#pragma once
// The least squares behind calibrate_hue. For the .cpp files of the calibration only.

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "sensors/colour/hue_calibration.h"
#include "sensors/colour/hue_model.h"

namespace touchstone::sensors {

/// A sample as the fits take it.
struct HueRow {
  std::size_t marker = 0;
  MarkerChange change;
  Eigen::Vector2d lateral = Eigen::Vector2d::Zero();  ///< as seen, mm
  double press = 0.0;                                 ///< mm, positive inwards
};

/// Eq. 4, both lines at once: every sample counts alike. At one depth only the gain there is fitted, and its slope is
/// 0.
/// @throws Error if there is no press, no lateral displacement, or (for a free offset) but one press
HueLine fit_line(const std::vector<HueRow>& rows, const HueModelForm& form);

/// A polynomial without a direction.
HueIsotropic fit_isotropic(const std::vector<HueRow>& rows, const HueModelForm& form);

/// A polynomial of all features.
HuePolynomial fit_polynomial(const std::vector<HueRow>& rows, const HueModelForm& form);

/// What the rows, and no change at all, span.
HueRange fit_range(const std::vector<HueRow>& rows);

}  // namespace touchstone::sensors
