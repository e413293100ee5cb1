#pragma once
// Forces from the pictures of a gelsight device [Li2015, sec. 4.2 and 4.3]: the sum of the height map against the
// normal force, the mean marker displacement against the shear force.

#include <string>
#include <vector>

#include "sensors/heights/height_model.h"
#include "sensors/markers/linear_force.h"
#include "sensors/markers/marker_tracker.h"
#include "sim/sensor/virtual_sensor.h"

namespace touchstone::lab {

/// What the tracker is given of a sensor's markers: their size and distance in its picture, from the device's print.
/// @throws Error for a device without a print
sensors::MarkerTrackerSettings marker_settings(const sim::VirtualSensor& sensor);

/// A frame without its markers, if the device has any: filled where the tracker finds them (`markers`, else nullptr).
cv::Mat without_markers(const cv::Mat& frame, const sensors::TrackedMarkers* markers, double diameter_px);

/// sensors::for_marked_gel with pictures of a marked sensor at rest, and its size of a pixel.
sensors::HeightModel for_marked_gel(sensors::HeightModel model, const sim::VirtualSensor& marked, std::uint64_t seed);

/// One press of one indenter under its load.
struct NormalSample {
  double force_N = 0.0;
  double estimated_mm3 = 0.0;  ///< sum of the estimated height map
  double true_mm3 = 0.0;       ///< sum of the membrane's true heights in the same pixels
};
/// One indenter at rising forces.
struct NormalSeries {
  std::string indenter;
  std::vector<NormalSample> samples;
  sensors::LinearForce estimated, truth;  ///< lines with an offset
};

/// Presses the middle of the gel with each of the forces (N, on the object, z). @pre at least three forces
NormalSeries press_with_forces(const sim::VirtualSensor& sensor, const sensors::HeightModel& model,
                               const sim::ObjectSpec& object, const std::vector<double>& forces_N, std::uint64_t seed);

/// One line through the samples of several indenters: what fig. 4-2a shows for balls.
struct PooledLines {
  sensors::LinearForce estimated, truth;
};
/// The lines through all series together.
PooledLines pool(const std::vector<NormalSeries>& series);

/// A quasi-static shear test (fig. 4-6): a flat end pressed with a constant force is dragged to the side until it
/// slides.
struct ShearSample {
  double drag_mm = 0.0;
  double force_N = 0.0;          ///< shear on the object
  double displacement_mm = 0.0;  ///< mean of the markers on the patch, since the press, as estimated
  bool slides = false;           ///< no vertex of the contact sticks
};
/// One drag at a held normal force.
struct ShearTest {
  std::vector<ShearSample> samples;
  sensors::LinearForce line;  ///< through the samples before slip, by the force alone (samples_before_slip)
  std::size_t before_slip = 0;
};
/// Presses the object, drags it `drag_mm` along x in so many steps, and reads the markers at each.
ShearTest shear_until_slip(const sim::VirtualSensor& sensor, const sim::ObjectSpec& object, double normal_N,
                           double drag_mm, int steps, std::uint64_t seed);

}  // namespace touchstone::lab
