#pragma once

#include <Eigen/Core>
#include <cmath>
#include <limits>

namespace touchstone::sensors {

/// Keeps the parameters that were best on data that aren't trained on, and says when they no longer get better: after
/// `patience` steps in a row without a new best one. (MATLAB's toolbox, which [Naeini2020] used, takes 6.)
class EarlyStopping {
 public:
  explicit EarlyStopping(int patience) : patience_(patience) {}

  /// Takes the state after a step (0: before the first one). Returns whether training should end.
  bool shows(int step, double validation_loss, const Eigen::VectorXd& parameters) {
    if (validation_loss < best_loss_) {
      best_loss_ = validation_loss;
      best_step_ = step;
      best_ = parameters;
    }
    return step - best_step_ >= patience_;
  }

  int best_step() const { return best_step_; }
  const Eigen::VectorXd& best() const { return best_; }

 private:
  int patience_;
  int best_step_ = 0;
  double best_loss_ = std::numeric_limits<double>::infinity();
  Eigen::VectorXd best_;
};

}  // namespace touchstone::sensors
