#pragma once
// A milky membrane lit by the room, from maps of what touches it (sim/sensor/membrane_camera.h).

#include <memory>

#include "fem/elements/compliance.h"
#include "sim/sensor/sensor_view.h"

namespace touchstone::sim {

struct VirtualSensorSettings;

/// Is the device one that milky_view can show: a bare scattering slab before the room, seen in one band?
bool is_milky(const DeviceSpec& device);

/// @pre is_milky(device), and it has a camera @throws Error as MembraneCamera
std::unique_ptr<const SensorView> milky_view(const DeviceSpec& device, const fem::Compliance& gel,
                                             const VirtualSensorSettings& settings);

}  // namespace touchstone::sim
