#include "sim/scene/device_faces.h"

namespace touchstone::sim {

std::vector<render::FlatFace> flat_faces(const DeviceSpec& device) {
  return {{-device.gel.thickness_mm - device.plate.thickness_mm, kAir, kPlate},
          {-device.gel.thickness_mm, kPlate, kGel}};
}

}  // namespace touchstone::sim
