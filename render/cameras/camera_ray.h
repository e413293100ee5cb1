#pragma once
// One path of light from the scene to a point of a camera's sensor.

#include <Eigen/Core>

namespace touchstone::render {

/// Frame: the camera's, mm.
struct CameraRay {
  Eigen::Vector3d origin;     ///< in the hole's middle plane, or on the lens
  Eigen::Vector3d direction;  ///< unit, into the scene
  double weight = 0.0;        ///< irradiance (W/m^2) at the sensor point per radiance (W/m^2/sr) along the ray
};

}  // namespace touchstone::render
