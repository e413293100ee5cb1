#pragma once
// From frames of a pressed ball to the curve from darkening to height [Lin2023].
//
// Within a contact the height is the ball's cap plus the press's own depth, which isn't known. Curve and depths are
// fitted together: the curve is 0 at darkening 0, never falls, and bends as little as the presses allow. So a press
// whose contact reaches the height of rest fixes its depth itself; one that doesn't (a thick gel sinks round the ball)
// takes it from the other presses, or from the curve going on straight down to rest.

#include <optional>
#include <span>
#include <vector>

#include "sensors/heights/darkness_model.h"
#include "sensors/heights/darkness_press.h"

namespace touchstone::sensors {

/// The pixels' size, how frames are measured, and whether halves are held out.
struct DarknessCalibrationSettings {
  PressScale scale{};
  DarkeningSettings darkening{};
  bool cross_validate = false;  ///< fill DarknessCalibration::held_out
};

/// Height by the curve less that of the ball at its fitted depth, mm.
struct ProfileError {
  double mean_mm = 0.0;       ///< over rings one pixel wide, of all presses
  double rms_mm = 0.0;        ///< likewise
  double largest_mm = 0.0;    ///< likewise, without sign
  double pixel_rms_mm = 0.0;  ///< of single pixels
};

/// A model and how well it does.
struct DarknessCalibration {
  DarknessModel model;
  std::vector<double> depths_mm;  ///< of the ball's lowest point, one a press
  std::size_t pixels = 0;         ///< that were learnt from
  double nearest_to_rest = 0.0;   ///< least darkening in a contact, 0 or below: the presses reach the height of rest
  ProfileError fitted;            ///< on the pixels that were learnt from
  /// Four times two halves of each contact, cut through its middle: learnt from one half, measured on the other, at the
  /// depth that the first half gave.
  std::optional<ProfileError> held_out;
};

/// @throws Error for a scale that isn't above zero, for no press, for presses that don't get darker with depth, or as
///   measure_press
DarknessCalibration calibrate_darkness(std::span<const BallPress> presses, const RestPicture& rest,
                                       const DarknessCalibrationSettings& settings);

}  // namespace touchstone::sensors
