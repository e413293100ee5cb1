#pragma once
// Fields and forces of a chroma sensor on disk, from frames of any source.

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/progress.h"
#include "datasets/sources/frame_source.h"
#include "sensors/colour/colour_marker_finder.h"
#include "sensors/colour/hue_estimator.h"
#include "sensors/tractions/marker_compliance.h"
#include "sensors/tractions/traction_inversion.h"

namespace touchstone::lab {

/// What turns fields into forces.
struct FieldForces {
  sensors::MarkerCompliance compliance;
  sensors::TractionSettings settings = {};
};

/// What came of all frames.
struct FieldSummary {
  int frames = 0;
  int markers = 0;                  ///< of all frames together
  int measured = 0;                 ///< of these
  int extrapolated = 0;             ///< of the measured
  int without_force = 0;            ///< frames with too few markers, measured and not extrapolated; 0 without forces
  std::vector<std::string> faults;  ///< of frames that can't be read or are unfit: they have no markers
};

/// What is known of one frame.
struct ShownField {
  const sensors::ColourMarkerReading& rest;
  const sensors::ColourMarkerReading& seen;
  const sensors::HueField& field;
  std::optional<Eigen::Vector3d> force_N = {};  ///< on the object; none without forces, or with too few markers
  std::string slip = {};                        ///< as in the table
};

/// Shown each frame with what is known of it; may be empty.
using ShowField = std::function<void(const datasets::SourceFrame& frame, const ShownField& field)>;

/// Estimates each frame, in their order, and writes FOLDER/displacements.csv and, if `forces` are given,
/// FOLDER/forces.csv (docs/file-formats.md, "Recorded frames"), as frames come: they are there when all are done. The
/// folder is made if it isn't there. A frame that can't be read or is unfit (see ColourMarkerFinder) has one line,
/// whose `flaw` says what is wrong.
/// @param rest the picture of the unloaded sensor
/// @throws Error naming the picture at rest if it can't be read or is unfit, or if all frames are; for a model that
///   doesn't fit the grid, or a compliance of another grid or another spacing than the model's
FieldSummary write_chroma_fields(const sensors::HueModel& model, const Eigen::Vector2i& grid,
                                 const std::filesystem::path& rest, const std::vector<datasets::FrameStream>& streams,
                                 const std::optional<FieldForces>& forces, const std::filesystem::path& folder,
                                 const Progress& progress = {}, const ShowField& show = {});

/// The picture at rest, read and found. @throws Error naming it
void find_rest_of(sensors::ColourMarkerFinder& finder, const std::filesystem::path& picture);

}  // namespace touchstone::lab
