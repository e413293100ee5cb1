#pragma once
// Marker displacements as a camera sees them, for inversion. Off the camera's axis a press shows as a shift as well
// (ViewParallax). To undo that takes the press, which hue hardly shows where a wide object stretches no marker; what is
// seen laterally is then better inverted as it is, with a compliance of what is seen.

#include "sensors/colour/marker_change.h"
#include "sensors/markers/marker_field.h"
#include "sensors/tractions/marker_compliance.h"

namespace touchstone::sensors {

/// Lateral displacements as seen; normal ones stay. Exactly what HueEstimator measured before it undid `parallax`.
/// @throws Error if field and compliance aren't of the same markers
MarkerField as_seen(MarkerField field, const MarkerCompliance& compliance, const ViewParallax& parallax);

/// The inverse: displacements as they are, of such as are seen. @throws Error as as_seen
MarkerField as_they_are(MarkerField seen, const MarkerCompliance& compliance, const ViewParallax& parallax);

/// The map from tractions to displacements as seen, to first order in them. @throws Error if it is faulty (fault_of)
MarkerCompliance as_seen(MarkerCompliance compliance, const ViewParallax& parallax);

}  // namespace touchstone::sensors
