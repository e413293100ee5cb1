#pragma once
// Force from events, grasp by grasp left out: [Naeini2020, sec. V.C, tables II and III, figs. 9 to 11].

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/progress.h"
#include "lab/dvs/dvs_sequences.h"
#include "sensors/events/time_delay_network.h"
#include "sensors/learning/gaussian_process_tuning.h"

namespace touchstone::lab {

/// Which force is learned, and how grasps are shared out to folds.
struct DvsForceSettings {
  DvsForce learned = DvsForce::measured;
  int validation = 5;        ///< grasps of a fold, drawn over the range of peak forces
  int every = 1;             ///< only each such fold is worked on, from the first on; at least 1
  std::uint64_t seed = 101;  ///< of the folds
  int threads = 0;           ///< 0: as many as the machine has; results are the same
};

/// One test grasp, by models that haven't seen it.
struct DvsForceFold {
  int grasp = 0;
  double validation_mse = 0.0;         ///< N^2, against the force that is learned
  double test_mse = 0.0;               ///< likewise
  double true_mse = 0.0;               ///< against the true force
  double true_grasping_mse = 0.0;      ///< of it, that of the grasping phase alone
  double sensor_mse = 0.0;             ///< of the reference sensor against the true force: no estimator is in it
  std::optional<double> least_change;  ///< N, where the learned force is 0.2 N or more; see least_force_change()
  int steps = 0;                       ///< of training
  double training_s = 0.0;             ///< of the thread's own time
  double window_us = 0.0;              ///< to estimate one window, of the thread's own time
};

/// The folds' results; figures are means over them.
struct DvsForceScore {
  std::vector<DvsForceFold> folds;

  /// Over the folds.
  double mean(double DvsForceFold::*figure) const;
  /// Standard error of that mean, from how folds differ. 0 for one fold.
  double standard_error(double DvsForceFold::*figure) const;
  /// sensors::sensitivity(). @throws Error if no fold has two windows in a row above 0.2 N
  double sensitivity_N() const;
};

/// Networks of one shape. Their first weights are drawn anew in each fold.
/// @throws Error for fewer grasps than the folds need, settings out of their range, and as the trainer
DvsForceScore test_force_networks(std::span<const DvsSequence> sequences,
                                  const sensors::TimeDelayNetworkSettings& network, const DvsForceSettings& settings,
                                  const Progress& progress = {});

/// Gaussian processes on ON, OFF and time, or what else is asked for, tuned in each fold. @throws Error likewise
DvsForceScore test_force_processes(std::span<const DvsSequence> sequences, const sensors::TuningSettings& tuning,
                                   const DvsForceSettings& settings, const Progress& progress = {},
                                   DvsInputs inputs = DvsInputs::counts_and_time);

}  // namespace touchstone::lab
