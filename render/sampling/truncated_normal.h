#pragma once
// Numbers drawn about a middle, within bounds.

#include <cmath>

#include "core/units.h"
#include "render/sampling/noise_quantile.h"

namespace touchstone::render {

/// The normal distribution cut off at `low` and `high` (low < high); the even one between them where the normal has
/// less than a millionth of its mass there. `value` is its quantile, `density` its density between the bounds.
class TruncatedNormal {
 public:
  /// The normal density of this middle and deviation, cut off at both ends. @pre low < high, deviation above 0
  TruncatedNormal(double middle, double deviation, double low, double high)
      : middle_(middle), deviation_(deviation), low_(low), width_(high - low) {
    below_ = 0.5 * std::erfc((middle - low) / (deviation * std::sqrt(2.0)));
    mass_ = 0.5 * std::erfc((middle - high) / (deviation * std::sqrt(2.0))) - below_;
    even_ = !(mass_ > 1e-6);
  }
  /// The value below which the share u of the density lies.
  double value(double u) const {
    if (even_) return low_ + u * width_;
    const double x = middle_ + deviation_ * normal_quantile(below_ + u * mass_);
    return std::fmin(std::fmax(x, low_), low_ + width_);
  }
  /// What the bounds leave of the whole normal distribution.
  double mass() const { return mass_; }
  /// 0 outside of the ends.
  double density(double x) const {
    if (even_) return 1.0 / width_;
    const double off = (x - middle_) / deviation_;
    return std::exp(-0.5 * off * off) / (std::sqrt(2.0 * kPi) * deviation_ * mass_);
  }

 private:
  double middle_, deviation_, low_, width_;
  double below_ = 0.0, mass_ = 0.0;
  bool even_ = false;
};

}  // namespace touchstone::render
