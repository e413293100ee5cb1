#pragma once

#include <string>

#include "sim/scene/device.h"
#include "sim/scene/object.h"

namespace touchstone::sim {

/// Says so in one sentence without a full stop where a body is more than ten times as long as the gel, or its longest
/// side is shorter than the edges that the gel is meshed with: most likely a length in another unit than mm. Names the
/// size that came out and the field that says the unit. Empty where there is no doubt.
std::string size_doubt(const DeviceSpec& device, const ObjectSpec& object);

}  // namespace touchstone::sim
