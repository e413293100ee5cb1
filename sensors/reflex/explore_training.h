#pragma once
// Explore mode learned from motions of dots whose presses and forces are known [Knoop2013, sec. III.E and IV.C].

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sensors/reflex/explore_model.h"

namespace touchstone::sensors {

/// The motion of the dots in one picture (explore_tracker.h), and what pressed then.
struct ExploreSample {
  DotsMotion motion;
  double press_mm = 0.0;  ///< of the object beyond the first touch; 0 or less: there is no contact
  double normal_N = 0.0;
  std::optional<Eigen::Vector2d> lateral_mm = {};  ///< how far the skin went sideways, where it's known
  std::optional<Eigen::Vector2d> shear_N = {};     ///< likewise
};

/// A model, and what it doesn't have.
struct TrainedExplore {
  ExploreModel model;
  std::string no_shear;  ///< why lateral displacements, and so shear, aren't known; empty if they are
};

/// Presses and forces of all samples, lateral displacements and shear of those in contact: if all of these say theirs
/// and they determine the laws. @param terms of the press's law, 1 to 3
/// @throws Error as fit_dilation_press and fit_exponential_force
TrainedExplore train_explore(std::span<const ExploreSample> samples, int terms = 3);

/// What a model errs by.
struct ExploreErrors {
  int samples = 0;
  double press_rms_mm = 0.0;
  double normal_rms_N = 0.0;
  std::optional<double> shear_rms_N = {};  ///< of samples in contact; none without law or truth
};
/// Asks the model about each sample.
ExploreErrors test_explore(const ExploreModel& model, std::span<const ExploreSample> samples);

/// The same of each sequence of samples by a model of the others. Nothing for fewer than two sequences, or where the
/// others of one don't determine a model.
std::optional<ExploreErrors> cross_validate_explore(std::span<const std::vector<ExploreSample>> sequences,
                                                    int terms = 3);

}  // namespace touchstone::sensors
