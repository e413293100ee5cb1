#pragma once
// What a marker's neighbours show of it. One marker alone doesn't show how far it was pressed: nearer to the camera and
// stretched it looks the same, larger. Its neighbours' places show how the skin between them stretched, and their sizes
// how steep the dent is.

#include "sensors/colour/colour_marker.h"

namespace touchstone::sensors {

/// Fills in the surroundings of all sound markers of `reading`, which may be `rest` itself.
/// @pre both are of the same grid
void find_surroundings(const ColourMarkerReading& rest, ColourMarkerReading& reading);

}  // namespace touchstone::sensors
