#pragma once
// A press that is asked for over HTTP.

#include "apps/frame_pages.h"
#include "sim/press/press_spec.h"

namespace touchstone::apps {

/// Of the values x_mm, y_mm, turn_x_deg, turn_y_deg, turn_z_deg, force_N, depth_mm, drag_x_mm and drag_y_mm; `object`
/// may stand beside them. @throws Error naming a value that isn't known or allowed
sim::PressSpec press_of(const Requested& requested);

}  // namespace touchstone::apps
