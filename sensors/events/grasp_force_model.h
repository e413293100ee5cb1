#pragma once

#include <optional>
#include <span>
#include <string>
#include <variant>

#include "sensors/events/time_delay_network.h"
#include "sensors/learning/gaussian_process.h"

namespace touchstone::sensors {

/// How far forces are off on grasps that weren't trained on: independent of the force, and growing with it.
struct GraspForceError {
  double left_out_N = 0.0;  ///< root mean square over all their judged windows
  double absolute_N = 0.0;  ///< sigma^2 = absolute_N^2 + (relative * force)^2
  double relative = 0.0;
};

/// Least squares of squared errors against the squares of forces, neither part below 0. @pre as many of both, one or
/// more
GraspForceError fit_force_error(std::span<const double> off_N, std::span<const double> force_N);

/// What turns a grasp's counts into force, and how well it does.
struct GraspForceModel {
  /// A network of ON and OFF counts, or a Gaussian process of ON, OFF and time since touch.
  std::variant<TimeDelayNetwork, GaussianProcess> estimator;
  /// None if the estimator wasn't tried on other grasps. A process' own noise says too little: it takes windows for
  /// independent, and those of one grasp err alike.
  std::optional<GraspForceError> error = {};

  /// Standard error of a force, N, where a process has this variance (0 of a network). None of a network that wasn't
  /// tried; of such a process that by its own noise.
  std::optional<double> sigma_N(double force_N, double variance) const;
};

/// What is wrong with a model (its inputs, an error that isn't finite or is negative), or nothing.
std::string fault_of(const GraspForceModel& model);

}  // namespace touchstone::sensors
