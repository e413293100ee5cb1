#pragma once

#include <Eigen/Core>

namespace touchstone::sensors {

struct BeadFilterSettings;

/// The second-order Kalman filter [Kalman1960] of [VisioHaptic2024, sec. 3.2.2] for one bead. The state of each axis is
/// position and velocity; over an interval dt the acceleration is a constant drawn from a normal distribution. Both
/// axes are measured together with the same noise, so they share one covariance.
struct BeadFilter {
  Eigen::Vector2d position = Eigen::Vector2d::Zero();    ///< px
  Eigen::Vector2d velocity = Eigen::Vector2d::Zero();    ///< px/s
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();  ///< of (position, velocity)

  /// Starts at `where`, measured, with a velocity not known.
  void start(const BeadFilterSettings& settings, const Eigen::Vector2d& where);
  /// The state `dt` seconds later. @pre dt > 0
  void predict(const BeadFilterSettings& settings, double dt);
  /// Takes a measured position, px.
  void correct(const BeadFilterSettings& settings, const Eigen::Vector2d& measured);
};

}  // namespace touchstone::sensors
