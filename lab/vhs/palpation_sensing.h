#pragma once
// What two sensors make of a press: the vhs sensor, by its beads, and the paper's own force sensor [VisioHaptic2024].
//
// The vhs sensor's frames aren't rendered press by press: a second of them takes 40 minutes of CPU time. Its chain is
// played from the beads' true images on: their mean over the exposure, the noise that the tracker's centroids have on
// rendered frames of the same sensor (measure_bead_noise), the tracker's own filter, and the published force model.

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "core/progress.h"
#include "lab/vhs/palpation_press.h"
#include "sensors/beads/bead_tracker.h"
#include "sensors/beads/stiffness_force_model.h"
#include "sim/scene/device.h"

namespace touchstone::lab {

/// The force model of the paper, trained as sec. 4.3 says on the vhs-demo's four training cycles, by the beads' true
/// images. @throws Error as reading and playing them do
sensors::StiffnessForceModel train_on_true_beads(const std::filesystem::path& scenes,
                                                 const std::filesystem::path& cache, const Progress& progress = {});

/// Tracked against true images of the beads, on rendered frames of a lump that presses.
struct BeadNoise {
  double noise_px = 0.0;           ///< standard deviation of a measured coordinate from frame to frame of one state
  double bias_px = 0.0;            ///< root mean square of a coordinate's mean error, less what it is at rest
  std::vector<double> force_N;     ///< true, of the states
  std::vector<double> model_N;     ///< what the model says by the true beads
  std::vector<double> measured_N;  ///< and by the mean measured ones
  Eigen::VectorXd rest_px;         ///< the beads at rest, as measured
  int frames = 0;
  int lost = 0;  ///< beads that weren't found, summed over the frames
};

/// On which states the noise is measured.
struct BeadNoiseSettings {
  int material = 9;  ///< of the spec
  /// A lump of opal lit from behind in a light panel, as the calibration's probe; else matt skin in a dim room.
  bool lit = true;
  std::vector<double> depths_mm = {0.5, 1.0, 1.5};
  int repeats = 8;  ///< frames of each state, and of the gel at rest
  std::uint64_t seed = 1;
};
/// Renders and tracks those states, and takes the noise from how their repeats differ.
BeadNoise measure_bead_noise(const PalpationSpec& spec, const std::filesystem::path& scenes,
                             const sensors::StiffnessForceModel& model, const BeadNoiseSettings& settings,
                             const std::filesystem::path& cache, const Progress& progress = {});

/// The waveform that the paper's force sensor records, N. A pure function.
std::vector<double> reference_waveform(const PalpationReference& reference, const PalpationRun& run, std::uint64_t seed,
                                       std::uint64_t index);

/// How the vhs sensor gets from beads to force.
struct VhsChain {
  sensors::StiffnessForceModel model;
  sensors::BeadFilterSettings filter;
  bool filtered = true;  ///< as the paper's sec. 3.2.2
  double noise_px = 0.0;
  double frame_rate_Hz = 601.25;
  double exposure_s = 1600e-6;
};

/// The waveform of z forces that it records, N, against its own first frames without load.
std::vector<double> vhs_waveform(const VhsChain& chain, const PalpationLaw& law, const PalpationRun& run,
                                 std::uint64_t seed, std::uint64_t index);

}  // namespace touchstone::lab
