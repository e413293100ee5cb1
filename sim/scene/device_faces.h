#pragma once
// The level faces of a device, and the media between them.

#include <vector>

#include "render/scene/scene.h"
#include "sim/scene/device.h"

namespace touchstone::sim {

/// Indices into render::Scene::media.
enum MediumIndex { kAir = 0, kPlate = 1, kGel = 2 };

/// Where air, plate and gel meet.
std::vector<render::FlatFace> flat_faces(const DeviceSpec& device);

/// Air, plate and gel, clear and with nothing in them: how light bends in front of a device, and no more. It has no
/// bands.
render::Scene clear_layers(const DeviceSpec& device);

}  // namespace touchstone::sim
