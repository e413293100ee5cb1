#pragma once
// The experiments of [VisioHaptic2024]: tracking a load cycle, training the stiffness coefficients (sec. 4.3), and the
// verification of the forces (sec. 4.4).

#include <Eigen/Core>
#include <array>
#include <functional>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/progress.h"
#include "datasets/sources/frame_source.h"
#include "lab/statistics/straight_line.h"
#include "sensors/beads/bead_tracker.h"
#include "sensors/beads/stiffness_force_model.h"
#include "sensors/beads/stiffness_training.h"

namespace touchstone::lab {

/// The mean error that the paper publishes, for each axis.
inline constexpr double kPublishedForceError_N = 0.1;

/// A sequence with what the tracker made of each of its frames.
struct TrackedSequence {
  datasets::FrameSequence source;
  std::vector<sensors::TrackedBeads> beads;
  std::vector<std::string> faults = {};  ///< of frames that couldn't be read or tracked: they aren't in `source`
  bool without_first = false;            ///< the first frame, which shows the rest, is among them

  std::int64_t lost() const;  ///< beads that weren't measured, summed over frames
};

/// @throws Error if the first frame of the sequence is left out
void require_first(const TrackedSequence& sequence);

/// Follows the beads through each sequence, from its first frame on. Sequences run in parallel. A frame that can't be
/// read or tracked is left out of its sequence. @throws Error if all frames of a sequence are
/// @param show shown each frame with its beads, by one sequence at a time; may be empty
std::vector<TrackedSequence> track(
    const std::vector<datasets::FrameStream>& streams, const sensors::BeadTrackerSettings& settings,
    const Progress& progress = {},
    const std::function<void(const datasets::SourceFrame& frame, const sensors::TrackedBeads& beads)>& show = {});

/// Training samples of tracked sequences. The rest positions are the mean over the sequences' first frames; frames in
/// which a bead wasn't measured are left out.
/// @throws Error if a frame has no force, or the first frame of a sequence doesn't show every bead
sensors::ForceSamples training_samples(const std::vector<TrackedSequence>& sequences, int grid);

/// Fig. 6a: one axis of the force against U_s, the displacements summed over all squares between beads (px).
struct ForceRelations {
  std::array<StraightLine, 3> axes;  ///< F_x of U_s,x, F_y of U_s,y, F_z of U_s,z; N and N/px
  std::array<std::vector<std::pair<double, double>>, 3> points;  ///< (U_s px, F N) that the lines go through
  double z_of_all_r2 = 0.0;  ///< of F_z of all three, the coupling that gives eq. 3 its last row
};
/// The lines of fig. 6a through these samples.
ForceRelations force_relations(const sensors::ForceSamples& samples);

/// Against which positions displacements are measured.
enum class RestChoice {
  model,       ///< those of the calibration
  first_frame  ///< those in each sequence's own first frame: the sensor was mounted anew since
};

/// One frame's force, estimated, and true where it's known.
struct ForceRecord {
  std::string sequence;
  int frame = 0;
  sensors::ForceEstimate estimate;
  std::optional<Eigen::Vector3d> truth;
};

/// The force of each frame; truth is kept beside it where there is one.
std::vector<ForceRecord> estimate_forces(const std::vector<TrackedSequence>& sequences,
                                         const sensors::StiffnessForceModel& model, RestChoice rest);

/// Errors of one axis over some frames, N.
struct AxisErrors {
  std::int64_t frames = 0;
  double mean_absolute = 0.0;
  double rms = 0.0;
  double largest = 0.0;
};

/// Errors over all records that have a truth. Index 0, 1, 2 is x, y, z.
std::array<AxisErrors, 3> force_errors(const std::vector<ForceRecord>& records);

/// The mean over the frames near one load.
struct LoadLevel {
  double load = 0.0;  ///< N, a multiple of the step
  std::int64_t frames = 0;
  double mean_true = 0.0;
  double mean_estimated = 0.0;
  double mean_absolute_error = 0.0;
};

/// What sec. 4.4 reports: normal force in frames without shear, at multiples of 0.5 N, and shear along x and along y,
/// at multiples of 0.3 N. Frames nearest to no load on an axis tell nothing of its error and don't count for it.
struct Verification {
  std::array<std::vector<LoadLevel>, 3> levels;  ///< x, y, z; sorted by load
  std::array<AxisErrors, 3> errors;
  std::optional<double> error_at_5N_percent;  ///< mean absolute error of z near 5 N, of 5 N
};
/// Errors of each axis over all records that have truth.
Verification verify_forces(const std::vector<ForceRecord>& records);

}  // namespace touchstone::lab
