#include "sim/scene/device_faces.h"

namespace touchstone::sim {

std::vector<render::FlatFace> flat_faces(const DeviceSpec& device) {
  return {{-device.gel.thickness_mm - device.plate.thickness_mm, kAir, kPlate},
          {-device.gel.thickness_mm, kPlate, kGel}};
}

render::Scene clear_layers(const DeviceSpec& device) {
  render::Scene layers;
  layers.media.resize(3);
  layers.media[kPlate].index = device.plate.refractive_index;
  layers.media[kGel].index = device.gel.refractive_index;
  layers.faces = flat_faces(device);
  return layers;
}

}  // namespace touchstone::sim
