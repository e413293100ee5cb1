#pragma once
// A validation row of a device's light: how far its direct light is off path tracing.

#include <string>

#include "lab/validation/validation.h"
#include "sim/sensor/virtual_sensor.h"

namespace touchstone::lab {

/// The error (percent, root mean square) of frames of `name`.yaml of the scenes' devices in the state that its sensor
/// judges them by, as row `id`. It holds up to 5 %, which the scenes of gelsight ask for; where paths are traced after
/// all the figure is no number.
/// @throws Error as VirtualSensor and read_device
ValidationRow direct_light_row(const std::string& id, const std::string& name,
                               const sim::VirtualSensorSettings& settings, const ValidateOptions& options);

}  // namespace touchstone::lab
