#pragma once
// The domed gelsight sensor against flat things [Li2015, sec. 2.2.1, fig. 2-9]: where a plate touches the dome, and
// what an estimator of heights that was made for flat gels makes of it.

#include <cstdint>
#include <span>
#include <vector>

#include "lab/gelsight/gelsight_height_experiment.h"
#include "sim/sensor/virtual_sensor.h"

namespace touchstone::lab {

/// What a frame's truth shows of a plate that is pressed on the dome.
struct PlateContact {
  double depth_mm = 0.0;          ///< of the plate below the dome, along the plate's normal
  double force_N = 0.0;           ///< normal to the gel's back
  double radius_mm = 0.0;         ///< of the disc of as many pixels as see contact
  Eigen::Vector2d centre_mm{};    ///< of those pixels, on the gel
  Eigen::Vector2d expected_mm{};  ///< where the plate is parallel to the dome
};

/// A plate pressed on the dome, tilted by `tilt` (radians) about the gel frame's y axis. The places of pixels are those
/// of the plane in which the plate touches: what is seen is nearer to the camera than the apex, so a pixel is smaller.
/// @pre the sensor's gel is a dome
PlateContact press_plate(const sim::VirtualSensor& sensor, double depth_mm, double tilt, std::uint64_t noise_seed);

/// Radius of the contact of a rigid plate on a dome under `force`, by closed forms: as a sphere of the dome's radius on
/// an endless layer of its thickness, frictionless (profile_on_layer; to first order in the dome's slope), and by
/// Hertz, which knows no plate behind the gel. @pre the gel is a dome
double plate_radius_on_layer(const sim::GelSpec& gel, double force);
/// By Hertz: the whole gel a half space. @pre the gel is a dome
double plate_radius_by_hertz(const sim::GelSpec& gel, double force);

/// Heights by a calibration whose balls were pressed on the dome itself, and whose background is the dome's own. Their
/// circles are given, as by an annotator who sees the contact: where sharp edges of the light guides' light cross a
/// ball's shadow, the finder of circles takes one contact for two. The
/// estimator takes the gel for flat: it reads slopes as if the gel at rest had none, so what it finds is off by up to
/// the dome's own slope wherever that isn't small against the object's.
struct DomeHeights {
  std::vector<HeightError> balls;  ///< of 4 mm, at the apex and at two places aside, 0.4 mm deep
  HeightError plate;               ///< 0.3 mm deep
};
/// Presses balls and a plate on the dome, and compares estimated with true heights.
DomeHeights measure_dome_heights(const sim::VirtualSensor& sensor, const CalibrationPresses& presses,
                                 sensors::LightCorrection correction, std::uint64_t seed);

}  // namespace touchstone::lab
