#pragma once
// Height maps of a simulated gelsight sensor: calibrated as a user would, held against the true membrane.

#include <cstdint>
#include <optional>
#include <vector>

#include "sensors/heights/height_calibration.h"
#include "sensors/heights/height_estimator.h"
#include "sim/sensor/virtual_sensor.h"

namespace touchstone::lab {

/// A rigid ball.
sim::ObjectSpec ball_of(double diameter_mm);
/// A cylinder's flat end, its edge rounded by 0.1 mm.
sim::ObjectSpec flat_cylinder_of(double diameter_mm);

/// The same object with Coulomb's `friction` on the gel.
sim::ObjectSpec with_friction(sim::ObjectSpec object, double friction);

/// The outline of what touches, as an annotator draws it who sees the contact: the disc of as many pixels about their
/// middle. Nothing where there is no contact. @pre contact is CV_8UC1, not 0 where there is contact
std::optional<sensors::ContactCircle> contact_circle(const cv::Mat& contact);

/// How a user calibrates: some frames of the untouched gel, and a ball pressed in at a grid of places, each to every
/// depth, and a wider one, which shows gentle slopes on more pixels than the small one's middle has. Circles are
/// annotated by hand: the contact's outline as it is, with errors of `annotation_px`.
struct CalibrationPresses {
  double ball_diameter_mm = 2.0;  ///< [Li2015, sec. 2.2.2]
  int columns = 4;
  int rows = 3;
  Eigen::Vector2d extent_mm = {11.0, 7.6};  ///< between the outermost places
  std::vector<double> depths_mm = {0.35, 0.6};
  double wide_ball_diameter_mm = 10.0;  ///< sec. 2.2.2: a larger one has more pixels
  double wide_ball_depth_mm = 0.3;      ///< 0: without the wide ball
  int background_frames = 8;
  double annotation_px = 0.3;  ///< standard deviation of each coordinate and of the radius
  double most_lost = 0.5;      ///< of a press's pixels: two channels at 255
};
/// A calibration, and how well its circles were found.
struct HeightCalibrationResult {
  sensors::HeightCalibration calibration;
  int presses = 0;
  int found_circles = 0;         ///< by find_contact_circle
  double circle_error_px = 0.0;  ///< of the small ball's: RMS distance from the contact's centre
};
/// `correction`: absent, the one that errs least on presses that are left out (HeightCalibrationSettings).
/// @throws Error as sensors::calibrate_height, or if a press can't be used
HeightCalibrationResult calibrate_heights(const sim::VirtualSensor& sensor, const CalibrationPresses& presses,
                                          std::optional<sensors::LightCorrection> correction, std::uint64_t noise_seed);

/// Estimated heights against the true membrane, over the pixels that see membrane.
struct HeightError {
  double mean_um = 0.0;  ///< of the absolute error
  double rms_um = 0.0;
  double worst_um = 0.0;
  double deepest_mm = 0.0;       ///< the true membrane's deepest point
  double depth_error_um = 0.0;   ///< estimated less true at that point
  double contact_overlap = 0.0;  ///< of the estimated and the true contact: common pixels / pixels of either
  double flank_slope = 0.0;      ///< true: 99 % of the contact's pixels are less steep
};
/// Compares both over the picture.
HeightError height_error(const sensors::HeightResult& estimate, const sim::Touch& touch, double mm_per_px);

/// The wave along u of a given wavelength in a part of a height map: least squares amplitude (half of trough to crest),
/// mm, beside a quadratic. NaN in the map are left out. @pre the part is inside of the map and wider than the wave
double wave_amplitude(const cv::Mat& height_mm, const cv::Rect& part, double wavelength_px);

}  // namespace touchstone::lab
