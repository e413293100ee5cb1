#include "sensors/markers/slip_rule.h"

namespace touchstone::sensors {

std::optional<double> force_ratio(const Eigen::Vector2d& shear_N, double normal_N, double least_normal_N) {
  if (!(normal_N >= least_normal_N) || !(normal_N > 0.0)) return std::nullopt;
  return shear_N.norm() / normal_N;
}

bool is_slip(std::optional<double> force_ratio, std::optional<double> motion_ratio, const SlipThresholds& thresholds) {
  return force_ratio && motion_ratio && *force_ratio > thresholds.force_ratio &&
         *motion_ratio > thresholds.motion_ratio;
}

}  // namespace touchstone::sensors
