#pragma once
// A coated gel in direct light from a light field, measured once; or traced, where direct light can't draw the device.

#include <filesystem>
#include <memory>

#include "fem/elements/compliance.h"
#include "sim/sensor/sensor_view.h"

namespace touchstone::sim {

struct VirtualSensorSettings;

/// @pre the device has a camera and a coating
std::unique_ptr<const SensorView> coated_view(const DeviceSpec& device, const fem::Compliance& gel,
                                              const std::filesystem::path& cache_folder,
                                              const VirtualSensorSettings& settings);

}  // namespace touchstone::sim
