#pragma once
// From frames of a pressed ball to a height model [Li2015, sec. 2.2.2, step 0].

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sensors/heights/ball_press.h"
#include "sensors/heights/frame_gain.h"
#include "sensors/heights/height_model.h"
#include "sensors/heights/slope_learning.h"

namespace touchstone::sensors {

/// What a model's slopes are read by.
enum class SlopeRegressor {
  table,    ///< SlopeTable: fastest, and best where light is even and nothing is cut off
  network,  ///< SlopeNetwork: for real light
  best      ///< the table, unless from five presses on its left-out error is above 0.08 and the network's is lower
};

/// The pixels' size, how light is corrected, and what slopes are read by.
struct HeightCalibrationSettings {
  double mm_per_px = 0.0;
  double gel_thickness_mm = 4.0;                ///< see PressSettings
  std::optional<LightCorrection> correction{};  ///< absent: the one with the least left-out error; `background` below 3
                                                ///< presses
  LampFit lamps{};                              ///< of `fitted`
  double rim_px = 1.0;                          ///< see PressSettings
  double most_lost = 0.5;                       ///< likewise
  SlopeTableSettings table{};
  SlopeRegressor slopes = SlopeRegressor::table;
  SlopeLearning learning{};     ///< of the network
  bool cross_validate = false;  ///< fill HeightCalibration::left_out
};

/// How far slopes are off on the calibration's own kind of pixels (root mean square of both components).
struct SlopeError {
  LightCorrection correction = LightCorrection::none;
  double rms = 0.0;
};

/// What became of a press.
struct PressUse {
  std::string name;
  std::string flaw;  ///< why it was left out, or empty
  ContactCircle circle;
  bool found = false;  ///< the circle wasn't given
  FrameGain gain;
};

/// A model and how well it does.
struct HeightCalibration {
  HeightModel model;
  std::vector<PressUse> presses;  ///< one each, in their order
  std::size_t pixels = 0;         ///< that were learnt from
  double rms_slope_error = 0.0;   ///< on them, by the table
  double bounded_share = 0.0;     ///< of the picture: too dark or too one-sidedly lit to be corrected in full
  TableCoverage coverage;
  /// Each press looked up in a table made of the others: what each correction would err by at a new place. From three
  /// presses on.
  std::vector<SlopeError> left_out;
  /// Each fifth of the presses read by a network made of the others, where a network was tried from five presses on.
  std::optional<double> network_left_out;
};

/// Presses that can't be used are left out and named in HeightCalibration::presses, for what see_press and samples_of
/// say, or because less than 0.4 of the picture is the untouched gel's, up to a gain: a frame of another sensor,
/// upside down, or of a contact that fills it. White balance is taken out if the gains of the others differ from 1 by
/// more than 1 % (root mean square).
/// @throws Error for a scale that isn't above zero, for no press, if none can be used, or as fit_lamps
HeightCalibration calibrate_height(std::span<const BallPress> presses, const Background& background,
                                   const HeightCalibrationSettings& settings);

/// @throws Error with the flaw of the first press that was left out, if any was
void require_all_used(const HeightCalibration& calibration);

}  // namespace touchstone::sensors
