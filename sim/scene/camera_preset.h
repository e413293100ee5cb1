#pragma once

#include "core/yaml_reader.h"

namespace touchstone::sim {

struct CameraSpec;

/// If the camera's block names a `preset`, fills in what render/imager/imager_presets.h knows of that imager:
/// resolution, pitch, active area, frame rate, row time, bits, Bayer layout, quantum efficiency and the figures of its
/// noise. Resolution and pitch go together: who reads out fewer, larger pixels overrides both.
/// @returns whether there was one
/// @throws Error with file and line for an unknown name, which lists the known ones
bool read_preset(YamlReader& in, CameraSpec& camera);

}  // namespace touchstone::sim
