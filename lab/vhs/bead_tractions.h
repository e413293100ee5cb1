#pragma once
// Tractions on the vhs sensor's gel and their sum, from tracked beads and the gel's compliance, on disk.

#include <filesystem>
#include <vector>

#include "lab/vhs/vhs_experiment.h"
#include "sensors/colour/marker_change.h"
#include "sensors/tractions/marker_compliance.h"
#include "sensors/tractions/traction_inversion.h"

namespace touchstone::lab {

/// How beads are described to the inversion: lateral displacements to 3 um, 0.1 px of the vhs sensor's; normal ones
/// unseen. Tractions are rougher than chroma's: correlated over a fifth of the gel's thickness, half of its modulus
/// strong. Chosen on presses of two points, others than those of the rows vhs.distribution.
sensors::TractionSettings bead_inversion();

/// How many frames gave a force.
struct TractionSummary {
  int frames = 0;
  int in_contact = 0;     ///< frames with a force
  int without_force = 0;  ///< frames with too few beads found
};

/// Writes FOLDER/tractions.csv, a line for each patch in contact of each frame, and FOLDER/forces.csv, a line for
/// each frame (docs/file-formats.md). The folder is made if it isn't there.
/// @param rest_px the beads without load, row by row; if empty, those of each sequence's first frame
/// @throws Error for a compliance of another number of beads, or as sensors::view_of; if a sequence's first frame is
///   needed and misses a bead
TractionSummary write_bead_tractions(const std::vector<TrackedSequence>& sequences,
                                     const std::vector<Eigen::Vector2d>& rest_px,
                                     const sensors::MarkerCompliance& compliance, const sensors::ViewParallax& parallax,
                                     const sensors::TractionSettings& settings, const std::filesystem::path& folder);

}  // namespace touchstone::lab
