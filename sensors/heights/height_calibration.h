#pragma once
// From frames of a pressed ball to a height model [Li2015, sec. 2.2.2, step 0].

#include <optional>
#include <span>
#include <vector>

#include "sensors/heights/ball_press.h"
#include "sensors/heights/height_model.h"

namespace touchstone::sensors {

/// The pixels' size, how light is corrected, and how the table is made.
struct HeightCalibrationSettings {
  double mm_per_px = 0.0;
  std::optional<LightCorrection> correction{};  ///< absent: the one with the least left-out error; `background` below 3
                                                ///< presses
  LampFit lamps{};                              ///< of `fitted`
  PressSampling sampling{};
  SlopeTableSettings table{};
  bool cross_validate = false;  ///< fill HeightCalibration::left_out
};

/// How far slopes are off on the calibration's own kind of pixels (root mean square of both components).
struct SlopeError {
  LightCorrection correction = LightCorrection::none;
  double rms = 0.0;
};

/// A model and how well it does.
struct HeightCalibration {
  HeightModel model;
  std::size_t pixels = 0;        ///< that were learnt from
  double rms_slope_error = 0.0;  ///< on them
  double bounded_share = 0.0;    ///< of the picture: too dark or too one-sidedly lit to be corrected in full
  TableCoverage coverage;
  /// Each press looked up in a table made of the others: what each correction would err by at a new place. From three
  /// presses on.
  std::vector<SlopeError> left_out;
};

/// @throws Error for a scale that isn't above zero, for no press, or as samples_of and fit_lamps
HeightCalibration calibrate_height(std::span<const BallPress> presses, const Background& background,
                                   const HeightCalibrationSettings& settings);

}  // namespace touchstone::sensors
