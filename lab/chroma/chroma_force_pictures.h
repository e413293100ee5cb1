#pragma once
// The probes of chroma_force_experiment.h as a chroma device's camera sees them: pictures, markers read by hue, and
// what that costs in forces.

#include <cstdint>
#include <vector>

#include "lab/chroma/chroma_force_experiment.h"
#include "lab/chroma/chroma_setup.h"
#include "sensors/colour/hue_calibration.h"

namespace touchstone::lab {

/// The probe as a body that can be seen. Its origin is that of contact_shape(probe).
sim::ObjectSpec visible_object(const ForceProbe& probe);

/// Plays a probe on the camera's own gel and reads a picture of each frame. Frame i has the noise of (noise_seed, i).
/// @throws Error if the gel goes beyond what the camera's sensor was set up for
std::vector<ChromaRecord> photograph_probe(const ForceSetup& setup, const ChromaSetup& camera, const ForceProbe& probe,
                                           const DragSettings& drag, std::uint64_t noise_seed);

/// Probes to calibrate on: balls of 8 to 16 mm and flat cylinders of 8 and 9 mm, none of which draw_force_probes draws;
/// they hold the gel fast, so that dragging shears it far.
std::vector<ForceProbe> calibration_probes(bool quick);

/// A HueModel of all markers that the calibration probes move, with the finite elements' truth. Its form (isotropic, up
/// to degree 3) is chosen by cross-validation over probes.
sensors::HueModel calibrate_on_probes(const ForceSetup& setup, const ChromaSetup& camera, bool quick,
                                      std::uint64_t noise_seed);

/// What a model says of all records, in their order, with lateral displacements as seen
/// (sensors/tractions/seen_markers.h).
std::vector<sensors::MarkerField> fields_of(const std::vector<ChromaRecord>& records, const ChromaSetup& camera,
                                            const sensors::HueModel& model,
                                            const sensors::MarkerCompliance& compliance);

/// Gives the field of a frame by the frame's number. @pre there is one for each frame that is asked for
MarkerReader fields_from(std::vector<sensors::MarkerField> fields);

}  // namespace touchstone::lab
