#pragma once
// The thesis's slip detector [Li2015, sec. 4.4]: two ratios, each above its threshold.

#include <Eigen/Core>
#include <optional>

namespace touchstone::sensors {

/// Force ratio rf: the length of the shear estimate over the normal estimate. The thesis speaks of the coefficient of
/// friction, which "when there is relative motion is generally larger than a certain threshold, e.g. 1", and shows rf
/// from 0.04 to 2.21 as the slope of a cone on axes without unit (fig. 4-7). Our reading: both estimates in N, so that
/// rf in sliding is the coefficient of kinetic friction as far as the estimates are right. Hence a threshold of 1 can't
/// see an object slide whose friction is below 1; the thesis's own soft gels grip more than that. None where the normal
/// force is below `least_normal_N`, since noise over nothing says nothing.
std::optional<double> force_ratio(const Eigen::Vector2d& shear_N, double normal_N, double least_normal_N = 0.02);

/// A frame is slip if both ratios are above their thresholds; the thesis's values.
struct SlipThresholds {
  double force_ratio = 1.0;   ///< Tf
  double motion_ratio = 0.5;  ///< Tm
};

/// rf > Tf and rm > Tm. A ratio that isn't known is no slip.
bool is_slip(std::optional<double> force_ratio, std::optional<double> motion_ratio,
             const SlipThresholds& thresholds = {});

}  // namespace touchstone::sensors
