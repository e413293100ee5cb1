#pragma once
// Five levels of softness from waveforms of one press: [VisioHaptic2024, sec. 2.3.1]. The paper makes pictures of the
// waveforms' frequencies over time and lets AlexNet classify them; here a small network does, on the same kind of
// pictures.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/progress.h"
#include "lab/vhs/palpation_press.h"
#include "lab/vhs/palpation_sensing.h"
#include "sensors/learning/confusion_matrix.h"
#include "sensors/skin/softness_model.h"

namespace touchstone::lab {

/// Pieces of each material, each with moduli of its own and pressed so often. No piece is in two of the three sets.
struct PalpationTrialSettings {
  int training_pieces = 8;
  int validation_pieces = 3;  ///< for early stopping
  int test_pieces = 8;
  int presses = 2;
  double seconds = 0.8;  ///< of a press, from the touch on
  std::uint64_t seed = 1;
};

/// What a waveform is for: no piece is in two sets.
enum class PalpationSet : std::uint8_t { training, validation, test };

/// The force over time of one press, at the recording's rate.
struct PalpationWaveform {
  int material = 0;
  PalpationSet set = PalpationSet::training;
  std::vector<double> force_N;
};

/// What one sensor recorded of all presses of a trial.
struct PalpationRecording {
  double rate_Hz = 0.0;
  std::vector<PalpationWaveform> waveforms;
};

/// The paper's force sensor behind a rigid face. `table` is of that face. The same arguments give the same numbers with
/// any number of threads.
PalpationRecording record_reference(const PalpationSpec& spec, const PalpationTable& table,
                                    const std::vector<std::vector<LumpMode>>& modes,
                                    const PalpationTrialSettings& settings);
/// The vhs sensor. `table` is of its gel.
PalpationRecording record_vhs(const PalpationSpec& spec, const PalpationTable& table,
                              const std::vector<std::vector<LumpMode>>& modes, const VhsChain& chain,
                              const PalpationTrialSettings& settings);

/// Every `factor`-th sample of each waveform.
PalpationRecording downsampled(const PalpationRecording& recording, int factor);

/// What the networks see and how they are trained.
struct SoftnessSettings : sensors::SoftnessTraining {
  /// Trained on all other materials and tested on this one; none: each material is in training, by other pieces.
  std::optional<int> unseen_material = {};

  /// sensors::usual_softness_training.
  static SoftnessSettings chosen();
};

/// How often level and material are right.
struct SoftnessScore {
  sensors::ConfusionMatrix levels;  ///< of the test waveforms
  /// Of each material's test waveforms, in per cent, how many were classified correctly.
  std::vector<double> right_percent;
  double percent() const { return 100.0 * levels.accuracy(); }
};

/// Trains on the training waveforms, stops by the validation's, and tests. @throws Error as the classifier
SoftnessScore tell_softness(const PalpationSpec& spec, const PalpationRecording& recording,
                            const SoftnessSettings& settings);

}  // namespace touchstone::lab
