#pragma once
// Designs of a sensor that reads forces from beads in its gel (vhs): how large its errors are with its estimator in the
// loop, how large they had to be at least, how much it can bear, and what of the three a change of design buys.
//
// Each design is set up whole. Pictures of a press up to the wanted load are rendered, exposed many times and tracked
// by the sensor's own tracker: that gives the noise of its centroids and how wrong they are, and the light gives the
// least noise that any tracker could have (centroid_bound.h). The motions of training and verification, thousands of
// frames, are played with tracking that is ideal but for noise of that size (ideal_tracking.h); the force model is
// trained and verified on them as in [VisioHaptic2024]. The bound on the force comes from presses and the least noise
// (force_bound.h).

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/progress.h"
#include "core/yaml_reader.h"
#include "lab/studies/design_plan.h"
#include "lab/studies/design_table.h"
#include "sensors/beads/stiffness_force_model.h"
#include "sim/scene/motion.h"
#include "sim/scene/object.h"

namespace touchstone::sensors {
EnumNames<StopRule> enum_names(StopRule);  // of the field `training_ends`
}

namespace touchstone::lab {

/// A study of this kind, as its file has it.
struct BeadDesignSpec {
  DesignPlan plan;
  DesignBase base;  ///< the device
  sim::ObjectSpec object;
  sim::MotionSpec training;                  ///< a load cycle; its start is moved to each place
  std::vector<Eigen::Vector2d> training_mm;  ///< places; empty: the middles of the squares between beads, as the paper
  bool training_centre = true;               ///< and the middle of all, beside either
  sensors::StopRule training_ends = sensors::StopRule::kLossDrop;
  sim::MotionSpec verification;                ///< where it says
  Eigen::Vector2d elsewhere_mm = {0.4, -0.3};  ///< the load cycle once more, at a place that isn't trained
  double load_N = 5.0;                         ///< normal: at which error, bound and strain are given
  double error_N = 0.1;                        ///< that is wanted there and in the verification
  double most_N = 20.0;                        ///< up to which the range is looked for
  double deepest_share = 0.25;                 ///< of the gel's thickness: beyond it a press is out of range
  int exposures = 12;                          ///< of each picture
};
void fields(YamlReader& in, BeadDesignSpec& spec);

/// The columns, in their order.
std::vector<DesignFigure> bead_design_figures(const BeadDesignSpec& spec);

/// One design's figures. @throws Error saying why it can't be had
std::vector<double> bead_design(const BeadDesignSpec& spec, const sim::DeviceSpec& device,
                                const std::filesystem::path& cache);

/// All designs, several at once, and the device as its file has it. The same for any number of threads. Gels aren't
/// kept: hundreds would fill the disk. @throws Error if the device itself can't be had
DesignTable run_bead_design(const BeadDesignSpec& spec, const Progress& progress = {});

/// With the answer in words: which design gives the wanted error at the wanted load, and what that costs.
StudyResult report(const std::string& name, const BeadDesignSpec& spec, const DesignTable& table);

}  // namespace touchstone::lab
