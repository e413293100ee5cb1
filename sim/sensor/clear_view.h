#pragma once
// A clear gel, traced: beads, and what touches the gel, are seen through it.

#include <memory>

#include "fem/elements/compliance.h"
#include "sim/sensor/sensor_view.h"

namespace touchstone::sim {

struct VirtualSensorSettings;

/// @pre the device has a camera @throws Error for a device that scenes can't show either
std::unique_ptr<const SensorView> clear_view(const DeviceSpec& device, const fem::Compliance& gel,
                                             const VirtualSensorSettings& settings);

}  // namespace touchstone::sim
