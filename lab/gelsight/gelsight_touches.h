#pragma once
// Touches of an object on a gelsight device, as an estimator gets them: heights on a straight grid of the gel's plane,
// with the pose that is true. What the map's and the insertion's experiments are made of.

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "sensors/touch_map/place_map.h"
#include "sensors/touch_map/planar_pose.h"
#include "sensors/touch_map/touch_image.h"
#include "sim/sensor/virtual_sensor.h"

namespace touchstone::lab {

/// How an object is held against the gel.
struct Grip {
  Eigen::Vector2d place_mm = Eigen::Vector2d::Zero();  ///< of the object's origin, gel frame
  double angle = 0.0;                                  ///< about z, radians
  Eigen::Vector2d tilt = Eigen::Vector2d::Zero();      ///< about x and y, radians
  double depth_mm = 0.25;                              ///< of the object's lowest point, untilted
};

/// What the estimator of heights makes of a frame: heights (CV_32FC1, mm, any constant may be added) in the camera's
/// pixels. `touch` holds the truth too, for a reader that is the truth.
using HeightReader = std::function<cv::Mat(const sim::Touch& touch)>;

/// One touch. Touch frame and gel frame agree.
struct TouchSample {
  sensors::TouchImage image;
  sensors::PlanarPose touch_from_object;  ///< true, of the touched face
  double force_N = 0.0;
};

/// A gelsight device with its height estimator and its map of places.
class TouchSetup {
 public:
  /// The place map is fitted to a grid of marks on the undeformed gel, as a target with printed dots would give it.
  /// Keeps a reference to the sensor.
  TouchSetup(const sim::VirtualSensor& sensor, HeightReader heights);

  /// Grip i has noise seed `seed` + i. Simulated side by side, read one after the other: the same touches with any
  /// number of threads.
  std::vector<TouchSample> touches(const sim::TouchObject& object, std::span<const Grip> grips,
                                   std::uint64_t seed) const;

  const sim::VirtualSensor& sensor() const { return sensor_; }
  const sensors::PlaceMap& places() const { return places_; }

 private:
  const sim::VirtualSensor& sensor_;
  HeightReader heights_;
  sensors::PlaceMap places_;
};

/// The estimator's heights: calibrated on the sensor by ball presses as a user would
/// (lab/gelsight/gelsight_height_experiment.h), integrated with a free border since objects run out of the picture.
/// @throws Error as calibrate_heights does
HeightReader estimated_heights(const sim::VirtualSensor& sensor, std::uint64_t seed);

}  // namespace touchstone::lab
