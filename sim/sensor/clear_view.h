#pragma once
// A clear gel, traced: beads, and what touches the gel, are seen through it.

#include <memory>

#include "fem/elements/compliance.h"
#include "sim/scene/scene.h"
#include "sim/sensor/sensor_view.h"

namespace touchstone::sim {

struct VirtualSensorSettings;

/// The scene that the view shows where `object` moves like this.
SceneSpec clear_scene(const DeviceSpec& device, const VirtualSensorSettings& settings, const ObjectSpec& object,
                      const MotionSpec& motion);

/// @pre the device has a camera @throws Error for a device that scenes can't show either
std::unique_ptr<const SensorView> clear_view(const DeviceSpec& device, const fem::Compliance& gel,
                                             const VirtualSensorSettings& settings);

}  // namespace touchstone::sim
