#pragma once
// A coated gel in direct light from a light field, measured once; or traced, where direct light can't draw the device.

#include <filesystem>
#include <memory>

#include "fem/elements/compliance.h"
#include "sim/scene/scene.h"
#include "sim/sensor/sensor_view.h"

namespace touchstone::sim {

struct VirtualSensorSettings;

/// The scene that the view shows where `object` moves like this: its switches are the view's. Its outputs are a scene's
/// defaults.
SceneSpec coated_scene(const DeviceSpec& device, const VirtualSensorSettings& settings, const ObjectSpec& object,
                       const MotionSpec& motion);

/// @pre the device has a camera and a coating
std::unique_ptr<const SensorView> coated_view(const DeviceSpec& device, const fem::Compliance& gel,
                                              const std::filesystem::path& cache_folder,
                                              const VirtualSensorSettings& settings);

}  // namespace touchstone::sim
