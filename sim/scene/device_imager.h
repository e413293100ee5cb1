#pragma once
// From a device file's camera to the imager behind its lens: what turns light into numbers.

#include "render/imager/imager.h"
#include "render/imager/motion_chip.h"
#include "sim/files/colour.h"
#include "sim/scene/device.h"

namespace touchstone::sim {

/// The imager of a device for light in these bands.
render::Imager imager(const DeviceSpec& device, const SceneBands& bands, bool with_noise);

/// The imager's temporal noise over the signal where a pixel is full, of the channel that has least: no pixel shows a
/// smaller part of its own light.
double least_noise_share(const CameraSpec& camera);

/// The motion chip of a device's camera. @throws Error with file and line if there is none or it makes no sense
render::MotionChipSettings motion_chip(const DeviceSpec& device, const SceneBands& bands, bool with_noise);

}  // namespace touchstone::sim
