#pragma once
// Where the dots on a fingertip's skin went in the picture: a plane parallel to the picture that comes nearer and moves
// sideways [Knoop2013, eq. 5].

#include <Eigen/Core>

namespace touchstone::sensors {

/// A dot at x goes to dilation * x + shift; x in pixels from the picture's middle, along columns and rows.
struct DotsMotion {
  double dilation = 1.0;
  Eigen::Vector2d shift_px = Eigen::Vector2d::Zero();

  Eigen::Vector2d operator()(const Eigen::Vector2d& place) const { return dilation * place + shift_px; }
  bool operator==(const DotsMotion&) const = default;
};

/// First one motion, then another.
inline DotsMotion then(const DotsMotion& first, const DotsMotion& second) {
  return {second.dilation * first.dilation, second(first.shift_px)};
}

/// What takes `from` to `to`. @pre from.dilation isn't 0
inline DotsMotion between(const DotsMotion& from, const DotsMotion& to) {
  const double dilation = to.dilation / from.dilation;
  return {dilation, to.shift_px - dilation * from.shift_px};
}

/// A motion's change per second, or a motion's part: dilation and shift each by themselves.
struct DotsVelocity {
  double dilation_per_s = 0.0;
  Eigen::Vector2d px_per_s = Eigen::Vector2d::Zero();
};

}  // namespace touchstone::sensors
