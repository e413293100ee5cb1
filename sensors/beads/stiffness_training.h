#pragma once
// Training of the stiffness coefficients by gradient descent from zero on the squared error [VisioHaptic2024, sec.
// 3.3.2].
//
// The loss is a quadratic form in the coefficients, so the descent needs the samples once, for the normal matrix, and
// then works on that: the iterates are those of full-batch gradient descent. Coefficients are scaled by the root mean
// square of their features (diagonal preconditioning), and the step is 1 / the largest eigenvalue of the scaled normal
// matrix: neither changes the model or its best coefficients, only how fast they're reached.

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "sensors/beads/stiffness_force_model.h"

namespace touchstone::sensors {

/// What a model is trained on: positions of the grid's beads (row-major, px) and the force (N) of each sample.
struct ForceSamples {
  int grid = 3;
  std::vector<Eigen::Vector2d> rest;                    ///< N^2, without load
  std::vector<std::vector<Eigen::Vector2d>> positions;  ///< one list of N^2 a sample
  std::vector<Eigen::Vector3d> forces;                  ///< one a sample
};

/// When the descent ends, and how it goes.
struct TrainingSettings {
  MatrixForm form = MatrixForm::kAsymmetric;
  StopRule stop = StopRule::kLossDrop;
  double loss_drop = 100.0;  ///< for StopRule::kLossDrop
  /// A step that would lower the loss by less than this part of it ends the descent, under either rule.
  double least_improvement = 1e-10;
  bool momentum = false;  ///< Nesterov's [Nesterov1983], begun anew whenever it points uphill
  std::int64_t max_iterations = 1'000'000;

  /// The paper's rule: plain descent until the loss is a hundredth.
  static TrainingSettings as_published() { return {}; }
  /// Descent with momentum until it no longer gets better. Where 5 N are to be known within 0.1 N this is needed: a
  /// hundredth of the loss is a tenth of the RMS force, so an error near 0.3 N on z may be left by the paper's rule.
  static TrainingSettings to_convergence() {
    return {.stop = StopRule::kConvergence, .least_improvement = 1e-14, .momentum = true};
  }
};

/// Why the descent ended.
enum class TrainingEnd : std::uint8_t {
  kLossDropped,  ///< the wanted drop was reached
  kConverged,    ///< no more improvement (also under StopRule::kLossDrop, if the wanted drop can't be reached)
  kOutOfIterations,
};
/// "loss dropped", "converged", "out of iterations"
const char* name_of(TrainingEnd end);

/// The loss at one iteration.
struct LossRecord {
  std::int64_t iteration = 0;
  Eigen::Vector3d loss = Eigen::Vector3d::Zero();  ///< mean squared error per axis, N^2
};

/// How the training went, and what errors are left on its samples.
struct TrainingReport {
  TrainingSettings settings;
  TrainingEnd end = TrainingEnd::kOutOfIterations;
  std::int64_t iterations = 0;
  Eigen::Vector3d first_loss = Eigen::Vector3d::Zero();  ///< with all coefficients 0: mean square force per axis
  Eigen::Vector3d final_loss = Eigen::Vector3d::Zero();  ///< mean squared error per axis, N^2
  Eigen::Vector3d r2 = Eigen::Vector3d::Zero();  ///< 1 - final loss / variance of the force; 0 for a constant force
  std::vector<LossRecord> history;               ///< iterations 0, 1, 2, 5, 10, 20, 50, ... and the last
};

/// What training gives.
struct TrainedModel {
  StiffnessForceModel model;
  TrainingReport report;
};

/// Trains a model. The total loss that the stop rules watch is the sum over the three axes.
/// @throws Error if a list has the wrong length, a value isn't finite, there's no sample, or all forces are 0
TrainedModel train(const ForceSamples& samples, const TrainingSettings& settings);

}  // namespace touchstone::sensors
