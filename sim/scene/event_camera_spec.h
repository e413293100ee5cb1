#pragma once
// The block `camera: {events: {...}}` of a device file.

#include "core/yaml_reader.h"
#include "render/events/event_pixels.h"

namespace touchstone::sim {

/// The event pixels of a camera. Their intensity is the photocurrent of the camera's own pixels: electrons a second
/// that light frees in `active_area_um2` with the quantum efficiency of the pixel's channel.
struct EventCameraSpec {
  render::EventPixelSettings pixels;
};

/// With `preset: davis240c` the figures are those of render::davis240c, scaled by `white_1klux_e_per_s`, the
/// photocurrent of a white surface under 1 klux as this optics shows it; other fields override them. Without it
/// `dark_e_per_s` must be given.
void fields(YamlReader& in, EventCameraSpec& events);

}  // namespace touchstone::sim
