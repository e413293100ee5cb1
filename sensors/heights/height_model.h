#pragma once
// What a height estimator knows of one sensor: everything that calibration has found.

#include <optional>
#include <string>

#include "sensors/heights/background.h"
#include "sensors/heights/lamp_model.h"
#include "sensors/heights/slope_network.h"
#include "sensors/heights/slope_table.h"

namespace touchstone::sensors {

/// Finest step of a model's table, digital numbers: finer ones don't fit the estimator's 16 bits under the strongest
/// correction (ColourCorrection::kLargestGain).
inline constexpr float kFinestStep_DN = 1.6F;
/// Of the lamps, along each side of the picture.
inline constexpr int kMostNodes = 64;

/// All that calibration has found about one sensor, and all that its model file holds.
struct HeightModel {
  double mm_per_px = 0.0;
  Background background;
  bool white_balance = false;  ///< frames' own gains are found and taken out (frame_gain.h)
  LightCorrection correction = LightCorrection::none;
  LampModel lamps;                      ///< corrects places if `correction` is fitted; always there
  SlopeTable table;                     ///< always there: it also knows which colours calibration has seen
  std::optional<SlopeNetwork> network;  ///< if there, slopes are its
  double steepest_calibrated = 0.0;     ///< slope that 99 % of the calibration's pixels are below
  int presses = 0;                      ///< that it was made of
};

/// What is wrong with a model, or the empty string: sizes that don't fit, figures that aren't finite or are out of
/// range.
std::string fault_of(const HeightModel& model);

/// The correction that belongs to the model.
ColourCorrection correction_of(const HeightModel& model);

}  // namespace touchstone::sensors
