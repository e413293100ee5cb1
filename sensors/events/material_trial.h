#pragma once
// How classifiers of materials do on grasps that they haven't seen: [Naeini2020, sec. V.D, tables IV and V, fig. 12].

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/progress.h"
#include "sensors/events/material_classifier.h"
#include "sensors/learning/confusion_matrix.h"

namespace touchstone::sensors {

/// The classifier, and how grasps are shared out to folds.
struct MaterialTrialSettings {
  MaterialClassifierSettings classifier;
  std::uint64_t seed = 102;  ///< of the folds
  int threads = 0;           ///< 0: as many as the machine has; results are the same
};

/// Confusion over all folds.
struct MaterialTrialScore {
  ConfusionMatrix test;        ///< each grasp once, by a classifier that hasn't seen it
  ConfusionMatrix validation;  ///< of each fold one grasp a material
  double training_s = 0.0;     ///< of a fold, in the mean, of the thread's own time
};

/// Leave-one-out over the samples, one of each material to validate on.
/// @throws Error for a material that has no sample or none left to train on, and as the trainer
MaterialTrialScore test_material_classifiers(std::span<const MaterialSample> samples,
                                             const std::vector<std::string>& materials,
                                             const MaterialTrialSettings& settings, const Progress& progress = {});

}  // namespace touchstone::sensors
