#pragma once
// Models of force and material from known grasps, and how they do on grasps that they haven't seen.

#include <cstdint>
#include <span>

#include "core/progress.h"
#include "sensors/events/grasp_force_model.h"
#include "sensors/events/known_grasp.h"
#include "sensors/events/material_classifier.h"
#include "sensors/learning/confusion_matrix.h"

namespace touchstone::sensors {

/// What learns forces from counts.
enum class GraspForceMethod { process, network };

/// How forces are learnt.
struct GraspForceTraining {
  GraspForceMethod method = GraspForceMethod::process;
  TimeDelayNetworkSettings network = {};  ///< the published ones
  int validation = 5;  ///< grasps that training is stopped or tuned by, over the range of forces; fewer of few
  int left_out = 12;   ///< grasps that a model of the others is tested on, each once; 0: none, and no error is known
  std::uint64_t seed = 1;  ///< of these choices
  int threads = 0;         ///< 0: as many as the machine has; results are the same
};

/// A model of force.
struct GraspForceCalibration {
  GraspForceModel model;
  std::int64_t windows = 0;  ///< that it was trained and tuned on
  int left_out = 0;          ///< grasps tested by models of the others
  double within_two = 0.0;   ///< share of their windows off by at most two stated standard errors, scale and all
};

/// @throws Error for fewer than three grasps, and as the trainers; @pre all have forces
GraspForceCalibration calibrate_grasp_force(std::span<const KnownGrasp> grasps, const GraspForceTraining& training,
                                            const Progress& progress = {});

/// A model of materials, tested on each grasp by one of the others.
struct GraspMaterialCalibration {
  MaterialClassifier model;
  ConfusionMatrix left_out;
};

/// @throws Error for a material with fewer than two grasps, and as the trainer
GraspMaterialCalibration calibrate_grasp_material(std::span<const KnownGrasp> grasps,
                                                  const MaterialClassifierSettings& settings, int threads,
                                                  const Progress& progress = {});

}  // namespace touchstone::sensors
