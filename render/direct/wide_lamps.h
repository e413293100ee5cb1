#pragma once
// Luminous rectangles cut into cells for direct light.

#include <vector>

#include "render/scene/lamp.h"

namespace touchstone::render {

/// One lamp is one beam to the light field, and a facet sees all of a beam or nothing: under a wide luminous rectangle
/// light would end at a line where it fades. So wide ones are cut into cells that send as much together, into some
/// 48 lamps with all others. Not beside light guides, which are cut into beams as far as beams go (guide_beams.h).
void cut_wide_lamps(std::vector<Lamp>& lamps);

}  // namespace touchstone::render
