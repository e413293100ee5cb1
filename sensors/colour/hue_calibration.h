#pragma once
// Makes a HueModel from samples with known displacements, and chooses among forms.

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "sensors/colour/colour_marker.h"
#include "sensors/colour/hue_model.h"

namespace touchstone::sensors {

/// One marker in one picture, with its true displacement.
struct HueSample {
  std::size_t marker = 0;                                     ///< its number in the grid
  ColourMarker seen;                                          ///< not flawed
  Eigen::Vector3d displacement_mm = Eigen::Vector3d::Zero();  ///< gel frame: a press is -z
  int series = 0;  ///< samples of one series (one press or one shear) are alike: they are left out together
};

/// What kind of model to make. The default is what did best on painted markers of 7 and 28 px, calibrated on shear
/// along one axis at several depths and tried on shear along a diagonal.
struct HueModelForm {
  HueForm form = HueForm::kIsotropic;
  // Of [Lin2019, eq. 4]:
  bool of_ink = false;       ///< of the ink's centroid
  bool free_offset = false;  ///< h0 is fitted, not the hue at rest: a better line, but then rest isn't zero
  // Of the other two:
  HueFeatures features = {.coloured_area = false};
  int degree = 2;         ///< 1 to 4
  double ridge = 1e-5;    ///< on terms of unit mean square, per sample; above 0
  bool symmetric = true;  ///< of kPolynomial: a square marker looks alike under its 8 turns and mirrorings: each sample
                          ///< counts as 8
};

/// The grid, the view and the form of the model.
struct HueCalibrationSettings {
  double spacing_mm = 3.0;  ///< between the grid's markers
  ViewParallax parallax = {};
  HueModelForm form = {};
  bool own_gains = false;  ///< fits the gains of each marker that has at least kLeastOwnSamples
};
inline constexpr int kLeastOwnSamples = 20;  ///< of a marker, for gains of its own
inline constexpr int kLeastHueSamples = 8;   ///< in all, for a calibration

/// Least squares of the form on all samples.
/// @param rest the picture at rest that goes with the samples
/// Samples whose neighbours aren't sound are left out of a form that needs them.
/// @throws Error for fewer than kLeastHueSamples, a flawed sample, a marker that isn't sound at rest, settings out of
///   range, or samples that don't determine the form (no press, or no lateral displacement, among them)
HueModel calibrate_hue(const ColourMarkerReading& rest, const std::vector<HueSample>& samples,
                       const HueCalibrationSettings& settings);

/// Errors over samples that the model estimates, mm. Those that it declines (their marker is flawed, or a neighbour
/// that the form needs) aren't in the first four.
struct HueErrors {
  std::size_t samples = 0;      ///< that were estimated
  double rms_lateral_mm = 0.0;  ///< per axis
  double rms_press_mm = 0.0;
  double largest_mm = 0.0;  ///< of the displacement's length
  std::size_t declined = 0;
  double rms_declined_mm = 0.0;  ///< of the declined samples' own displacement
  double rms_mm() const;         ///< of the displacement's length
  double rms_of_all_mm() const;  ///< likewise, with each declined sample as one that was taken for unmoved
};

/// A model's errors on samples.
HueErrors hue_errors(const HueModel& model, const ColourMarkerReading& rest, const std::vector<HueSample>& samples);

/// The errors of a form on samples it wasn't calibrated on: each series is left out in turn.
/// @throws Error for fewer than 2 series, or as calibrate_hue
HueErrors cross_validate_hue(const ColourMarkerReading& rest, const std::vector<HueSample>& samples,
                             const HueCalibrationSettings& settings);

/// A form and how well it does on presses that it wasn't fitted to.
struct HueFormScore {
  HueModelForm form;
  HueErrors errors;  ///< cross-validated
};

/// Eq. 4; isotropic and other polynomials of degrees 1 to 4 and several ridges, of all that one marker shows, of that
/// without areas, of hue and one centroid, and of a marker with its neighbours.
std::vector<HueModelForm> usual_hue_forms();

/// Scores each form by cross-validation, the best (least rms of the displacement's length) first. Forms that the
/// samples can't determine are left out.
/// @throws Error if that is all of them
std::vector<HueFormScore> rank_hue_forms(const ColourMarkerReading& rest, const std::vector<HueSample>& samples,
                                         const HueCalibrationSettings& settings,
                                         const std::vector<HueModelForm>& forms);

}  // namespace touchstone::sensors
