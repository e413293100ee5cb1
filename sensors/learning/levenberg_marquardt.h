#pragma once
// Levenberg-Marquardt [Marquardt1963] for networks: [Naeini2020, eqs. 2 and 3]. Each step solves (J^T J + lambda I) p =
// -J^T F, F the errors of all samples and J their derivatives by all parameters; lambda goes down after a step that
// lowers the sum of squares at once, and up, with the step tried again, after one that doesn't.
//
// The paper's network of k = 4, n = 40 has more parameters (5241 with two counts in three windows) than samples (some
// 2000). Then the same step is p = -J^T (J J^T + lambda I)^-1 F, whose matrix is only as large as the samples are many.
// And a network's J needn't be formed for it: a sample's derivatives by the weights of a layer are an outer product (of
// what comes back to its sums, d, and what goes in, a), so (J J^T)_ij is the sum over layers of (d_i . d_j) (a_i . a_j
// + 1). Which of the two forms is cheaper is decided by their operations.
//
// Ceres 2.1 was measured beside it: 1848 samples, one core of a busy machine, DENSE_NORMAL_CHOLESKY, one residual block
// with the same analytic Jacobian, trust region radius 100 (a damping of 0.01). Seconds an iteration: k = 4, n =
// 40: 8.4 with Eigen, 6.2 with OpenBLAS, here 0.39; k = 2, n = 20: 0.09 and 0.04; k = 1, n = 10: 0.005 and 0.003. Mean
// squared error after 50 steps, k = 2, n = 20: 0.39 with Ceres as it comes (its damping is scaled by the Jacobian's
// columns), 0.0096 with the identity of eq. 3, 0.0035 here; k = 1, n = 10: 0.25 to 0.30, 0.44 and 0.46. So which ends
// lower depends on the problem, Ceres can't use the small matrix, and Debian's links SuiteSparse's SPQR and CHOLMOD,
// GPL in parts.

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "sensors/learning/feed_forward_network.h"

namespace touchstone::sensors {

/// Inputs and wanted outputs, a column a sample.
struct NetworkSamples {
  Eigen::MatrixXd inputs;
  Eigen::MatrixXd targets;
};

/// Which of two systems with the same solution is solved for a step; kCheaper takes the smaller one.
enum class StepForm : std::uint8_t {
  kCheaper,
  kNormal,  ///< a matrix of parameters x parameters
  kDual,    ///< a matrix of samples x samples
};

/// Eq. 3 at one place.
class LevenbergMarquardtSystem {
 public:
  /// @pre the network has one output, sizes fit, at least one sample
  LevenbergMarquardtSystem(const FeedForwardNetwork& network, const NetworkSamples& samples,
                           StepForm form = StepForm::kCheaper);

  double sum_of_squares() const { return errors_.squaredNorm(); }     ///< F^T F
  const Eigen::VectorXd& half_gradient() const { return gradient_; }  ///< J^T F
  StepForm form() const { return form_; }                             ///< which one was taken
  /// p; nothing where rounding leaves the matrix without a factor. @pre damping > 0
  std::optional<Eigen::VectorXd> step(double damping) const;

 private:
  StepForm form_;
  LayerValues values_;
  std::vector<Eigen::MatrixXd> by_sums_;
  Eigen::VectorXd errors_;
  Eigen::VectorXd gradient_;
  Eigen::MatrixXd matrix_;  ///< lower triangle of J^T J or J J^T
};

/// J, samples x parameters. @pre the network has one output, sizes fit
Eigen::MatrixXd jacobian(const FeedForwardNetwork& network, const Eigen::MatrixXd& inputs);

/// How the damping changes, and when training ends.
struct LevenbergMarquardtSettings {
  double first_damping = 0.01;  ///< lambda of eq. 3; the paper's
  double damping_up = 10.0;     ///< factor after a step that failed; above 1
  double damping_down = 0.1;    ///< factor after one that succeeded at once; above 0, below 1
  double most_damping = 1e10;
  double least_damping = 1e-12;
  double least_gradient = 1e-7;  ///< of J^T F, its largest entry: below, training ends
  int most_steps = 1000;
  int patience = 6;  ///< see EarlyStopping; only with validation samples
  StepForm form = StepForm::kCheaper;
};

/// Why training ended.
enum class NetworkTrainingEnd : std::uint8_t {
  kValidation,  ///< early stopping
  kFlat,        ///< the gradient has vanished
  kStuck,       ///< no damping up to the largest lowers the sum of squares
  kOutOfSteps,
};
/// "validation", "flat", "stuck", "out of steps"
const char* name_of(NetworkTrainingEnd end);

/// The losses after one step.
struct NetworkTrainingStep {
  double training_loss = 0.0;
  double validation_loss = 0.0;  ///< 0 without validation samples
};

/// How training went, and which step's network was kept.
struct NetworkTrainingReport {
  NetworkTrainingEnd end = NetworkTrainingEnd::kOutOfSteps;
  int steps = 0;                             ///< taken
  int best_step = 0;                         ///< whose parameters were kept
  int factorisations = 0;                    ///< or, for other trainers, gradients
  std::vector<NetworkTrainingStep> history;  ///< mean losses; 0: before the first step
};

/// Trains all parameters on the squared error. With validation samples (their list may be empty: 0 columns) the
/// parameters with the least error on those are kept.
/// @throws Error for a network without exactly one output, sizes that don't fit, no sample, a value that isn't finite,
/// or a setting out of its range
NetworkTrainingReport train_by_levenberg_marquardt(FeedForwardNetwork& network, const NetworkSamples& training,
                                                   const NetworkSamples& validation,
                                                   const LevenbergMarquardtSettings& settings = {});

}  // namespace touchstone::sensors
