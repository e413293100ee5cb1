#pragma once
// From tracked beads to displacements in mm, as maps from displacements to forces take them (traction_inversion.h).

#include <Eigen/Core>
#include <span>

#include "sensors/beads/bead_tracker.h"
#include "sensors/markers/marker_field.h"
#include "sensors/tractions/marker_compliance.h"

namespace touchstone::sensors {

/// How the picture's px go with the gel's mm at the beads' depth: px = offset + px_per_mm * turn * mm, with x and y of
/// the gel frame along the picture's, as the upright picture shows them, but for a small turn.
struct BeadView {
  double px_per_mm = 0.0;
  double turn_rad = 0.0;                                ///< from the gel's x to the picture's, towards y
  Eigen::Vector2d offset_px = Eigen::Vector2d::Zero();  ///< where the gel frame's origin, at that depth, is seen
  double rms_px = 0.0;                                  ///< of what the beads at rest lie aside from that

  Eigen::Vector2d lateral_mm(const Eigen::Vector2d& motion_px) const;  ///< of a motion in the picture
};

/// The view that fits the beads' positions at rest best. @param rest_px of each bead, row by row
/// @throws Error if there are not as many as the compliance has beads, if one isn't finite, if they all coincide, or if
///   they lie aside by more than a fifth of a spacing (root mean square): other beads, or a picture turned or mirrored
BeadView view_of(std::span<const Eigen::Vector2d> rest_px, const MarkerCompliance& compliance);

/// Displacements since rest along x and y, as the camera sees them (seen_markers.h); of z nothing is known, it is 0.
/// Beads that weren't found aren't measured. @throws Error if beads, rest and compliance aren't of the same number
MarkerField bead_field(const TrackedBeads& beads, std::span<const Eigen::Vector2d> rest_px, const BeadView& view,
                       const MarkerCompliance& compliance);

}  // namespace touchstone::sensors
