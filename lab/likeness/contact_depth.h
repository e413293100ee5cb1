#pragma once
// How deep a device's ball has to be pressed for a contact of a wanted width, by the device's own mechanics: the gel
// sinks round a ball, so the ball's cap alone doesn't say.

#include <map>
#include <optional>
#include <vector>

#include "core/progress.h"
#include "sim/scene/object.h"
#include "sim/sensor/virtual_sensor.h"

namespace touchstone::lab {

/// Depth against the touched part's radius in the picture, both growing.
struct DepthTable {
  std::vector<double> depth_mm;   ///< beyond first touch; begins with 0
  std::vector<double> radius_px;  ///< sqrt(touched pixels / pi) of the device's picture; begins with 0

  /// Linear between the table's rows; none above its last radius.
  std::optional<double> depth_of(double radius_px) const;
};

/// Presses the ball in the gel's middle, step by step down to `deepest_mm`. @pre deepest_mm > 0
/// @throws Error as VirtualSensor::press, or where the camera sees nothing of the deepest contact
DepthTable measure_depths(const sim::VirtualSensor& sensor, const sim::TouchObject& ball, double deepest_mm,
                          const Progress& progress = {});

/// A ball of a recording and how deep it goes.
struct RecordedBall {
  sim::TouchObject object;
  DepthTable depths;
};

/// The steel ball of this radius; measured (measure_depths) where it isn't among `balls` yet, by radius, mm.
const RecordedBall& recorded_ball(std::map<double, RecordedBall>& balls, const sim::VirtualSensor& sensor,
                                  double radius_mm, double deepest_mm, const Progress& progress = {});

}  // namespace touchstone::lab
