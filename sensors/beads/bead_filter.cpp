#include "sensors/beads/bead_filter.h"

#include "sensors/beads/bead_tracker.h"

namespace touchstone::sensors {

void BeadFilter::start(const BeadFilterSettings& settings, const Eigen::Vector2d& where) {
  position = where;
  velocity.setZero();
  covariance.setZero();
  covariance(0, 0) = settings.measurement_px * settings.measurement_px;
  covariance(1, 1) = settings.first_velocity_px_per_s * settings.first_velocity_px_per_s;
}

void BeadFilter::predict(const BeadFilterSettings& settings, double dt) {
  position += dt * velocity;
  Eigen::Matrix2d step;
  step << 1.0, dt, 0.0, 1.0;
  const Eigen::Vector2d push(0.5 * dt * dt, dt);  // what a unit acceleration does in dt
  const double variance = settings.acceleration_px_per_s2 * settings.acceleration_px_per_s2;
  covariance = (step * covariance * step.transpose() + variance * push * push.transpose()).eval();
}

void BeadFilter::correct(const BeadFilterSettings& settings, const Eigen::Vector2d& measured) {
  const double noise = settings.measurement_px * settings.measurement_px;
  const Eigen::Vector2d gain = covariance.col(0) / (covariance(0, 0) + noise);
  const Eigen::Vector2d innovation = measured - position;
  position += gain[0] * innovation;
  velocity += gain[1] * innovation;
  // Joseph's form keeps the covariance symmetric and positive whatever the rounding.
  Eigen::Matrix2d keep;
  keep << 1.0 - gain[0], 0.0, -gain[1], 1.0;
  covariance = (keep * covariance * keep.transpose() + noise * gain * gain.transpose()).eval();
}

}  // namespace touchstone::sensors
