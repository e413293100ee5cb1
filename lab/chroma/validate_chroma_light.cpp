// How far the chroma devices' frames, made by direct light that passes films, are off path tracing: what all other rows
// of the sensor that are made of pictures stand on.

#include "lab/chroma/chroma_setup.h"
#include "lab/validation/direct_light_row.h"

namespace touchstone::lab {

std::vector<ValidationRow> validate_chroma_light(const ValidateOptions& options) {
  const sim::VirtualSensorSettings settings = chroma_sensor_settings(1);
  return {direct_light_row("chroma.light.setup_error_percent", "chroma", settings, options),
          direct_light_row("chroma.light.compact_error_percent", "chroma-compact", settings, options)};
}

}  // namespace touchstone::lab
